// A loop closer with another detector or verifier on a ring, and whether its closures are right.
#pragma once

#include <memory>
#include <string>

#include "services/loop_closer/loop_closer.hpp"
#include "tests/catch.hpp"
#include "tests/loop_closer/ring_drive.hpp"

namespace understory::test {

inline loop_closer::LoopCloserParameters chosen(const std::string& detector,
                                                const std::string& verifier) {
  loop_closer::LoopCloserParameters parameters;
  parameters.search.detector = detector;
  parameters.search.verifier = verifier;
  parameters.stems.use_diameters = false;
  parameters.accept.closed_m = 0.0;
  return parameters;
}

struct Found {
  std::size_t queries = 0;
  std::size_t sent = 0;
  std::size_t wrong = 0;
};

/// A wrong one is half a metre and five of its standard deviations off.
inline void count(const RingDrive& drive, const loop_closer::LoopCloserParameters& parameters,
                  Found& found, bool has_clouds = false) {
  loop_closer::LoopCloser closer(parameters);
  ReckoningMapper mapper(drive);
  for (std::size_t k = 0; k < drive.size(); ++k) {
    if (has_clouds) closer.add(drive.cloud_at(k));
    closer.add(drive.keyframe_at(k));
    const auto closure = closer.add(mapper.update(k));
    if (!closure) continue;
    ++found.sent;
    const geometry::SE2 truth =
        drive.truth(closure->from.keyframe).inverse() * drive.truth(closure->to.keyframe);
    const Eigen::Vector3d off = (closure->from_T_to.mean.inverse() * truth).Log();
    const double chi2 = off.dot(closure->from_T_to.covariance.inverse() * off);
    if (off.head<2>().norm() > 0.5 && chi2 > 25.0) ++found.wrong;
  }
  found.queries += closer.counters().queries;
}

inline RingOptions ring(std::uint64_t seed, double laps) {
  RingOptions options;
  options.seed = seed;
  options.laps = laps;
  return options;
}

/// Drives twice, once with a restart from the saved state every 23 keyframes: the same closures and
/// the same state, to the byte. Gives the number of closures.
inline std::size_t same_after_restarts(const RingDrive& drive,
                                       const loop_closer::LoopCloserParameters& parameters,
                                       bool has_clouds = false) {
  loop_closer::LoopCloser whole(parameters);
  auto stopped = std::make_unique<loop_closer::LoopCloser>(parameters);
  ReckoningMapper mapper(drive);
  ReckoningMapper again(drive);
  std::size_t sent = 0;

  for (std::size_t k = 0; k < drive.size(); ++k) {
    for (loop_closer::LoopCloser* const one : {&whole, stopped.get()}) {
      if (has_clouds) one->add(drive.cloud_at(k));
      one->add(drive.keyframe_at(k));
    }
    const auto one = whole.add(mapper.update(k));
    const auto other = stopped->add(again.update(k));
    REQUIRE(one.has_value() == other.has_value());
    if (one) {
      ++sent;
      CHECK(one->from_T_to.mean.coordinates() == other->from_T_to.mean.coordinates());
    }

    if (k % 23 != 0) continue;
    const std::string state = stopped->save();
    CHECK(state == whole.save());
    stopped = std::make_unique<loop_closer::LoopCloser>(parameters);
    stopped->load(state);
  }
  return sent;
}

}  // namespace understory::test
