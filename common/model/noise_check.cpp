#include "common/model/noise_check.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>

namespace understory::model {
namespace {

/// One range [m] in each part that DetectionNoise tells apart.
constexpr std::array<double, 4> kRanges_m = {5.0, 15.0, 30.0, 60.0};

/// Change of a factor that is told.
constexpr double kNews = 1.25;

/// The factor that is farthest from 1.
NoiseVerdict largest_factor(const DetectionNoise& noise) {
  NoiseVerdict largest;
  for (const LandmarkKind kind : {LandmarkKind::kTrunk, LandmarkKind::kCorner}) {
    for (const double range_m : kRanges_m) {
      const double factor = std::sqrt(noise.factor(kind, range_m));
      if (std::abs(std::log(factor)) <= std::abs(std::log(largest.sigma_factor))) continue;
      largest.sigma_factor = factor;
      largest.kind = kind;
      largest.range_m = range_m;
    }
  }
  return largest;
}

/// "trunks 15 m away have 2.00 times the stated sigma"
std::string factor_text(const NoiseVerdict& verdict) {
  std::array<char, 96> text{};
  const char* kind = verdict.kind == LandmarkKind::kTrunk ? "trunks" : "corners";
  const int size =
      std::snprintf(text.data(), text.size(), "%s %.0f m away have %.2f times the stated sigma",
                    kind, verdict.range_m, verdict.sigma_factor);
  return {text.data(), static_cast<std::size_t>(size)};
}

}  // namespace

std::string contradiction_text(const NoiseVerdict& verdict) {
  return "the scans contradict the covariances of LANDMARKS: " + factor_text(verdict) +
         "; what the scans show is used";
}

void NoiseCheck::add(const LandmarkScan& stated, std::span<const std::uint64_t> tracks,
                     const DetectionNoise& noise) {
  verdict_ = largest_factor(noise);
  verdict_.is_misstated = noise.is_misstated();
  // What was confirmed stays so while the statement comes and goes at a limit.
  if (!verdict_.is_misstated) return;
  check_.add(noise.corrected(stated), tracks);
  verdict_.is_corrected = !check_.is_new() && !check_.is_misstated();
}

std::optional<std::string> NoiseNews::add(const NoiseVerdict& verdict) {
  if (!verdict.is_corrected) return std::nullopt;
  const double change = verdict.sigma_factor / told_factor_;
  if (std::max(change, 1.0 / change) < kNews) return std::nullopt;
  told_factor_ = verdict.sigma_factor;
  return "covariances of LANDMARKS are replaced, and the new ones explain the scans: " +
         factor_text(verdict);
}

}  // namespace understory::model
