// Whether covariances that take the place of stated ones explain the scans.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string>

#include "common/model/detection_noise.hpp"

namespace understory::model {

/// What the scans say of the covariances that LANDMARKS states.
struct NoiseVerdict {
  bool is_misstated = false;  ///< The scans contradict them; what the scans show is used instead.
  /// The covariances used instead explain the scans: nothing is wrong beyond the statement.
  bool is_corrected = false;
  /// True standard deviation by the stated one, of the kind and range where it is farthest from 1.
  double sigma_factor = 1.0;
  LandmarkKind kind = LandmarkKind::kTrunk;  ///< Of that factor.
  double range_m = 0.0;                      ///< Likewise: in the middle of the range.
  /// Whether somebody has to be told.
  bool is_open() const { return is_misstated && !is_corrected; }
};
/// What a person is told while the verdict is open, with its factor.
std::string contradiction_text(const NoiseVerdict& verdict);

/// Puts the corrected covariances to the test that the stated ones failed: scans a few scans apart,
/// which no odometry, map or filter takes part in. Costs as much as DetectionNoise, and only while
/// the statement is contradicted.
class NoiseCheck {
 public:
  /// `parameters`: those of the DetectionNoise that corrects.
  explicit NoiseCheck(const DetectionNoiseParameters& parameters = {}) : check_(parameters) {}

  /// Takes a scan as stated, with the landmark of each detection as in DetectionNoise::add(), and
  /// `noise`, which took it before.
  void add(const LandmarkScan& stated, std::span<const std::uint64_t> tracks,
           const DetectionNoise& noise);
  /// By the scans so far.
  const NoiseVerdict& verdict() const { return verdict_; }

  /// Members of a saved state; see common/state. The parameters are configuration.
  template <class Archive, class Self>
  static void archive(Archive& a, Self& self) {
    a(self.check_, self.verdict_.is_misstated, self.verdict_.is_corrected,
      self.verdict_.sigma_factor, self.verdict_.kind, self.verdict_.range_m);
  }

 private:
  DetectionNoise check_;  ///< Of the corrected scans.
  NoiseVerdict verdict_;
};

/// What LOG has of a correction that is in force and confirmed: once, and again where its factor
/// has changed by a quarter.
class NoiseNews {
 public:
  /// The verdict after a scan; the text where there is something new to tell.
  std::optional<std::string> add(const NoiseVerdict& verdict);

  /// Members of a saved state; see common/state.
  template <class Archive, class Self>
  static void archive(Archive& a, Self& self) {
    a(self.told_factor_);
  }

 private:
  double told_factor_ = 1.0;
};

}  // namespace understory::model
