// The IMU's latest sample, and the attitude for its levelling.
#pragma once

#include <cstdint>
#include <deque>
#include <optional>
#include <stdexcept>

#include "common/model/imu.hpp"
#include "services/lidar_imu_input/attitude_filter.hpp"
#include "services/lidar_imu_input/level_motion.hpp"

namespace understory::lidar_imu_input {

/// Owns the attitude filter and the sample up to which it has been propagated. Invariant: after
/// begin() there are an attitude, a latest sample, and that sample levelled.
class Levelling {
 public:
  /// `imu`: noise and priors of the attitude filter.
  explicit Levelling(const ImuParameters& imu) : imu_(imu) {}

  /// The first sample (frame vehicle): tilt from its force.
  void begin(const model::ImuSample& sample);
  /// Propagates the attitude from the latest sample to this one, `seconds` later. `is_saturated`:
  /// samples between the two were omitted. Precondition: begin() was called.
  void propagate(const model::ImuSample& sample, bool is_saturated, double seconds);
  /// Propagates over `seconds` without samples: the uncertainty of the attitude grows.
  void bridge(double seconds);
  /// Stores a rest: the vehicle is stationary at this sample, and the attitude, propagated to it,
  /// was updated by that.
  void keep_rest(const model::ImuSample& sample);
  /// Corrects a late detection of motion: for some tenths of a second the vehicle moved, but the
  /// attitude was updated with zero velocity. The attitude is reset to that of 0.2 to 0.4 s ago,
  /// propagated by the samples since, and marked (mark_level()). Returns the time of the reset;
  /// does nothing if no rest was stored.
  std::optional<model::Utime> start_moving();
  /// The sample in `vehicle_level`, by the present attitude. Precondition: begin() was called.
  LevelSample level(const model::ImuSample& sample, bool is_saturated) const;
  /// Sets the latest sample.
  void set_latest(const model::ImuSample& sample, const LevelSample& level);

  /// None before the first sample.
  const std::optional<AttitudeFilter>& attitude() const { return attitude_; }
  std::optional<AttitudeFilter>& attitude() { return attitude_; }  ///< For updates.
  /// Latest sample, frame vehicle; none before the first.
  const std::optional<model::ImuSample>& latest() const { return latest_; }
  /// The same sample levelled.
  const std::optional<LevelSample>& latest_level() const { return latest_level_; }
  /// Whether a loaded state satisfies the invariant.
  bool is_whole() const {
    const bool has_begun = attitude_.has_value();
    return has_begun == latest_.has_value() && has_begun == latest_level_.has_value() &&
           rests_.empty() == since_rest_.empty();
  }

  /// Members of a saved state; see common/state. The rest is configuration.
  template <class Archive, class Self>
  static void archive(Archive& a, Self& self) {
    bool has_attitude = self.attitude_.has_value();
    std::uint64_t rests = self.rests_.size();
    a(has_attitude, rests);
    if constexpr (Archive::kReads) {
      const AttitudeFilter any(self.imu_, Eigen::Vector3d(0.0, 0.0, kGravity_mps2));
      self.attitude_ = has_attitude ? std::optional(any) : std::nullopt;
      if (rests > kRests || (rests > 0 && !has_attitude))
        throw std::invalid_argument("rests of an attitude that no state has");
      self.rests_.assign(rests, {0, any});
    }
    if (has_attitude) a(*self.attitude_);
    for (auto& rest : self.rests_) a(rest.utime, rest.attitude);
    a(self.since_rest_, self.latest_, self.latest_level_);
  }

 private:
  void propagate(const model::ImuSample& from, const model::ImuSample& to, bool is_saturated,
                 double seconds);

  struct Rest {
    model::Utime utime = 0;
    AttitudeFilter attitude;
  };
  static constexpr std::size_t kRests = 2;

  ImuParameters imu_;
  std::optional<AttitudeFilter> attitude_;
  /// A sample, and whether samples before it were omitted.
  struct Step {
    model::ImuSample sample;
    bool is_saturated = false;

    template <class Archive, class Self>
    static void archive(Archive& a, Self& self) {
      a(self.sample, self.is_saturated);
    }
  };
  std::deque<Rest> rests_;       ///< The latest, in order of time.
  std::deque<Step> since_rest_;  ///< From the older rest's sample on; empty without rests.
  std::optional<model::ImuSample> latest_;
  std::optional<LevelSample> latest_level_;
};

}  // namespace understory::lidar_imu_input
