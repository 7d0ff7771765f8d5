// The stage alone, with a mapper that only reckons.
#include <Eigen/Cholesky>
#include <optional>
#include <set>

#include "services/loop_closer/loop_closer.hpp"
#include "tests/catch.hpp"
#include "tests/loop_closer/ring_drive.hpp"

using namespace understory;
using namespace understory::loop_closer;
using test::ReckoningMapper;
using test::RingDrive;
using test::RingOptions;
using Status = model::LoopResult::Status;

namespace {

LoopCloserParameters parameters() {
  LoopCloserParameters result;
  result.stems.use_diameters = false;
  return result;
}

/// The closures of a drive; `answer` is what the mapper makes of each.
std::vector<model::LoopClosure> closures_of(const RingDrive& drive, LoopCloser& closer,
                                            Status answer = Status::kWaiting,
                                            bool knows_again = false) {
  ReckoningMapper mapper(drive, knows_again);
  std::vector<model::LoopClosure> closures;
  for (std::size_t k = 0; k < drive.size(); ++k) {
    closer.add(drive.keyframe_at(k));
    if (const auto closure = closer.add(mapper.update(k))) {
      closures.push_back(*closure);
      CHECK(closer.add(model::LoopResult{0, 0, 1, closure->id, answer, ""}));
    }
  }
  return closures;
}

/// How far a closure is from the truth [m].
double error_m(const RingDrive& drive, const model::LoopClosure& closure) {
  const geometry::SE2 truth =
      drive.truth(closure.from.keyframe).inverse() * drive.truth(closure.to.keyframe);
  return (closure.from_T_to.mean.inverse() * truth).translation().norm();
}

}  // namespace

TEST_CASE("A drive that comes back closes, as its covariance says", "[loop_closer]") {
  double nees = 0.0;
  std::size_t count = 0;
  for (const std::uint64_t seed : {1, 2, 3}) {
    RingOptions options;
    options.seed = seed;
    const RingDrive drive(options);
    LoopCloser closer(parameters());
    const auto closures = closures_of(drive, closer);
    CAPTURE(seed);
    REQUIRE(closures.size() >= 5);
    std::set<std::uint64_t> ids;
    for (const model::LoopClosure& closure : closures) {
      CHECK(ids.insert(closure.id).second);
      CHECK(closure.from.submap == 0);
      CHECK(closure.to.keyframe > closure.from.keyframe + 50);
      CHECK(closure.log10_false_alarm <= -3.0);
      CHECK(error_m(drive, closure) < 0.3);
      const geometry::SE2 truth =
          drive.truth(closure.from.keyframe).inverse() * drive.truth(closure.to.keyframe);
      const Eigen::Vector3d off = (closure.from_T_to.mean.inverse() * truth).Log();
      nees += off.dot(closure.from_T_to.covariance.llt().solve(off));
      ++count;
    }
    CHECK(closer.counters().sent == closures.size());
    CHECK(closer.counters().waiting == closures.size());
  }
  CHECK(nees / static_cast<double>(count) < 6.0);  // 3 is exact.
}

TEST_CASE("A drive that does not come back closes nothing", "[loop_closer]") {
  for (const std::uint64_t seed : {11, 12, 13}) {
    RingOptions options;
    options.seed = seed;
    options.radius_m = 100.0;
    options.laps = 0.9;
    options.blind_to = options.blind_from;
    const RingDrive drive(options);
    LoopCloser closer(parameters());
    CHECK(closures_of(drive, closer).empty());
    CHECK(closer.counters().queries > 50);
  }
}

TEST_CASE("What the mapper's poses do not allow is found all the same", "[loop_closer]") {
  RingOptions options;
  options.seed = 21;
  options.yaw_bias_rad = 4e-3;  // 40 degrees and more in a lap, and 2 are stated.
  const RingDrive drive(options);
  LoopCloser closer(parameters());
  const auto closures = closures_of(drive, closer);
  REQUIRE(closures.size() >= 3);
  CHECK(closer.counters().unexpected == closures.size());
  for (const model::LoopClosure& closure : closures) {
    CHECK(closure.log10_false_alarm <= -6.0);
    CHECK(error_m(drive, closure) < 0.3);
  }
}

TEST_CASE("After an accepted closure the next one is some way on", "[loop_closer]") {
  RingOptions options;
  const RingDrive drive(options);
  LoopCloser waiting(parameters());
  LoopCloser accepted(parameters());
  const auto many = closures_of(drive, waiting);
  const auto few = closures_of(drive, accepted, Status::kAccepted);
  REQUIRE_FALSE(few.empty());
  CHECK(few.size() < many.size());
  CHECK(accepted.counters().accepted == few.size());
}

TEST_CASE("On ground that the mapper knows nothing is kept and nothing looked for",
          "[loop_closer]") {
  RingOptions options;
  options.laps = 3.0;
  options.blind_to = options.blind_from;
  const RingDrive drive(options);
  LoopCloser closer(parameters());
  // Until three landmarks of the first lap are seen again, nothing is known.
  for (const model::LoopClosure& closure : closures_of(drive, closer, Status::kAccepted, true))
    CHECK(closure.to.keyframe < drive.per_lap());
  const std::uint64_t queries = closer.counters().queries;
  const double lap_m = options.step_m * static_cast<double>(drive.per_lap());
  CHECK(static_cast<double>(closer.memory().places().size()) < 1.1 * lap_m / 4.0);
  CHECK(queries < closer.memory().places().size());
}

TEST_CASE("What somebody took back is not said again", "[loop_closer]") {
  const RingDrive drive(RingOptions{});
  LoopCloser closer(parameters());
  ReckoningMapper mapper(drive);
  std::optional<model::LoopClosure> revoked;
  std::size_t at = 0;
  for (std::size_t k = 0; k < drive.size(); ++k) {
    closer.add(drive.keyframe_at(k));
    const auto closure = closer.add(mapper.update(k));
    if (!closure) continue;
    if (!revoked) {
      revoked = closure;
      at = k;
      CHECK(closer.add(model::LoopResult{0, 0, 1, closure->id, Status::kRevoked, ""}));
      continue;
    }
    CHECK(2.0 * static_cast<double>(k - at) >= SentClosures::kRevokedM - 1.0);
  }
  REQUIRE(revoked);
  CHECK(closer.counters().revoked == 1);
  CHECK_FALSE(closer.add(model::LoopResult{0, 0, 1, 77, Status::kRevoked, ""}));
}

TEST_CASE("A keyframe that was handed over is an end by its submap", "[loop_closer]") {
  const RingDrive drive(RingOptions{});
  LoopCloser here(parameters());
  LoopCloser away(parameters());
  ReckoningMapper mapper(drive);
  model::Submap submap;
  submap.id = 9;
  const geometry::SE2 submap_T_base0(3.0, -2.0, 0.7);
  std::size_t compared = 0;
  for (std::size_t k = 0; k < drive.size(); ++k) {
    const model::MapUpdate update = mapper.update(k);
    if (k < drive.per_lap() / 2) {
      submap.keyframes.push_back(
          {k, update.utime, submap_T_base0 * drive.truth(k), 1e-6 * Eigen::Matrix3d::Identity()});
    } else if (k == drive.per_lap() / 2) {
      away.add(submap);
      away.add(submap);  // It is sent until a store has it.
    }
    here.add(drive.keyframe_at(k));
    away.add(drive.keyframe_at(k));
    const auto one = here.add(update);
    const auto other = away.add(update);
    REQUIRE(one.has_value() == other.has_value());
    if (!one) continue;
    REQUIRE(other->from.submap == 9);
    CHECK(other->id == one->id);
    const geometry::SE2 expected =
        submap_T_base0 * drive.truth(one->from.keyframe) * one->from_T_to.mean;
    CHECK((expected.inverse() * other->from_T_to.mean).Log().norm() < 1e-9);
    CHECK(other->from_T_to.covariance.trace() > one->from_T_to.covariance.trace());
    ++compared;
  }
  CHECK(compared >= 3);
}

TEST_CASE("A restarted loop closer continues as if it had not stopped", "[loop_closer][state]") {
  const RingDrive drive(RingOptions{});
  const auto outputs = [&](std::optional<std::size_t> restart) {
    auto closer = std::make_unique<LoopCloser>(parameters());
    ReckoningMapper mapper(drive);
    std::vector<std::string> bytes;
    for (std::size_t k = 0; k < drive.size(); ++k) {
      closer->add(drive.keyframe_at(k));
      if (restart == k) {
        const std::string saved = closer->save();
        closer = std::make_unique<LoopCloser>(parameters());
        closer->load(saved);
        REQUIRE(closer->save() == saved);
      }
      if (const auto closure = closer->add(mapper.update(k))) {
        bytes.push_back(state::save({"output", 1}, closure->id, closure->from_T_to,
                                    closure->log10_false_alarm));
        closer->add(model::LoopResult{0, 0, 1, closure->id, Status::kWaiting, ""});
      }
    }
    bytes.push_back(closer->save());
    return bytes;
  };

  const auto expected = outputs(std::nullopt);
  REQUIRE(expected.size() > 3);
  for (const std::size_t restart : {std::size_t{0}, drive.size() / 3, drive.size() - 10})
    CHECK(outputs(restart) == expected);

  LoopCloser closer(parameters());
  CHECK_THROWS_AS(closer.load("no state"), std::invalid_argument);
  CHECK(closer.memory().places().empty());
}

TEST_CASE("Places of a map that was left are told apart", "[loop_closer]") {
  const RingDrive drive(RingOptions{});
  LoopCloser closer(parameters());
  ReckoningMapper mapper(drive);
  for (std::size_t k = 0; k < drive.size(); ++k) {
    closer.add(drive.keyframe_at(k));
    model::MapUpdate update = mapper.update(k);
    if (k >= drive.per_lap() / 2) update.map_id = 2;
    CHECK_FALSE(closer.add(update));
  }
  CHECK(closer.counters().other_map > 0);
}

TEST_CASE("Keyframes and updates that do not belong together do no harm", "[loop_closer]") {
  const RingDrive drive(RingOptions{});
  LoopCloser closer(parameters());
  ReckoningMapper mapper(drive);
  for (std::size_t k = 0; k < 100; ++k) {
    if (k % 3 != 0) closer.add(drive.keyframe_at(k));
    closer.add(mapper.update(k));
  }
  CHECK(closer.counters().keyframes_missing == 34);
  CHECK(closer.counters().keyframes == 66);
}
