// The points of one sweep for place recognition.
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "common/model/landmarks.hpp"

namespace understory::model {

/// A point of a PlaceScan: 6 bytes, because many are stored.
struct PlacePoint {
  std::int16_t x_cm = 0;
  std::int16_t y_cm = 0;
  std::int16_t z_cm = 0;

  /// [m], in the frame of the scan.
  Eigen::Vector3f position_m() const {
    return 0.01F * Eigen::Vector3f(static_cast<float>(x_cm), static_cast<float>(y_cm),
                                   static_cast<float>(z_cm));
  }
  friend bool operator==(const PlacePoint&, const PlacePoint&) = default;

  /// For saving and loading.
  template <class Archive, class Self>
  static void archive(Archive& a, Self& s) {
    a(s.x_cm, s.y_cm, s.z_cm);
  }
};

/// Largest coordinate of a PlacePoint [m].
inline constexpr float kMostDistantPlacePointM = 327.0F;
/// The point nearest to `position_m`. Precondition: no coordinate is beyond
/// kMostDistantPlacePointM.
PlacePoint place_point(const Eigen::Vector3f& position_m);

/// Channel PLACE_SCAN: points of a sweep, frame `vehicle_level` at utime, down-sampled. Input of
/// loop detectors that compare clouds.
struct PlaceScan {
  /// This many points have 60 kB.
  static constexpr std::size_t kMostPoints = 9900;

  Utime utime = 0;
  std::uint64_t sequence = 0;
  std::vector<PlacePoint> points;
};

}  // namespace understory::model
