// The filter's motion between its poses.
#include "services/geoslam_mapper/smoothing/filter_track.hpp"

#include "tests/catch.hpp"

using namespace understory;
using namespace understory::geoslam_mapper::smoothing;

TEST_CASE("Between two poses the filter's velocity carries on, whatever its direction",
          "[mapper]") {
  // In a map that is rotated, on a straight line, drifting sideways.
  const geometry::SE2 start(7.0, -3.0, 1.1);
  const Eigen::Vector2d velocity_mps(4.0, -1.5);
  const auto moved = [&](model::Utime utime) {
    const Eigen::Vector2d driven_m = 1e-6 * static_cast<double>(utime) * velocity_mps;
    return start * geometry::SE2(driven_m.x(), driven_m.y(), 0.0);
  };
  FilterTrack track;
  for (int k = 0; k <= 20; ++k) {
    model::EkfPose pose;
    pose.utime = k * 100'000;
    pose.ekf_map_T_vehicle = moved(pose.utime);
    pose.velocity_mps = velocity_mps;
    track.add(pose);
  }
  for (model::Utime from = 0; from < 2'000'000; from += 130'000) {
    for (model::Utime to = from; to <= 2'000'000; to += 170'000) {
      const auto motion = track.between(from, to);
      REQUIRE(motion);
      CHECK((motion->inverse() * (moved(from).inverse() * moved(to))).Log().norm() < 1e-9);
    }
  }
}
