// Drives of stem frames: what they see follows from the parameters, and from the seed alone.
#include "sim/stem_frames.hpp"

#include <algorithm>
#include <map>
#include <set>

#include "sim/point_grid.hpp"
#include "sim/random_streams.hpp"
#include "tests/catch.hpp"

using namespace understory;
using namespace understory::sim;

namespace {

sim::Forest small_forest(std::uint64_t seed) {
  sim::ForestParameters parameters = forest_parameters(sim::ForestKind::kIntermediate);
  parameters.side_m = 250.0;
  auto random = random_stream(seed, sim::Stream::kForest);
  return make_forest(parameters, random);
}

/// Without noise: every stem can be told.
StemDriveParameters exact() {
  StemDriveParameters parameters;
  parameters.detector.position_sigma_m = 0.0;
  parameters.detector.false_per_frame = 0.0;
  parameters.detector.detection = 1.0;
  return parameters;
}

Eigen::Vector2d in_world(const model::StemFrame& frame, const model::Stem& stem) {
  return (frame.world_T_sensor * stem.position_m).head<2>();
}

/// Trunks that a drive saw in some frame.
std::set<std::uint32_t> seen_trunks(const sim::PointGrid& grid,
                                    const std::vector<model::StemFrame>& frames) {
  std::set<std::uint32_t> seen;
  for (const model::StemFrame& frame : frames) {
    for (const model::Stem& stem : frame.stems) {
      const auto nearest = grid.nearest(in_world(frame, stem));
      REQUIRE(nearest);
      REQUIRE(nearest->distance_m < 1e-6);
      seen.insert(nearest->index);
    }
  }
  return seen;
}

}  // namespace

TEST_CASE("Stem frames show trunks where they are, levelled by the attitude", "[stem-frames]") {
  const sim::Forest forest = small_forest(1);
  const sim::PointGrid grid(forest.trunks_m, 10.0);
  const sim::Route way = make_stem_way(StemWay::kWander, forest, 200.0, 3);
  const auto frames = drive_stem_frames(forest, way, exact(), 3);
  REQUIRE(frames.size() > 50);
  CHECK(seen_trunks(grid, frames).size() > 50);
  for (std::size_t i = 1; i < frames.size(); ++i) CHECK(frames[i].utime > frames[i - 1].utime);
  for (const model::StemFrame& frame : frames) {
    for (const model::Stem& stem : frame.stems) {
      CHECK(stem.position_m.head<2>().norm() < 25.0 + 0.5);
      CHECK((frame.world_T_sensor.linear() * stem.axis - Eigen::Vector3d::UnitZ()).norm() < 1e-9);
    }
  }
}

TEST_CASE("The same seed gives the same frames, another visit other stems of the same share",
          "[stem-frames]") {
  const sim::Forest forest = small_forest(2);
  const sim::PointGrid grid(forest.trunks_m, 10.0);
  const sim::Route way = make_stem_way(StemWay::kWander, forest, 500.0, 4);
  StemDriveParameters parameters = exact();
  parameters.visit_gap_s = 1e6;  // one visit per drive
  const auto frames = drive_stem_frames(forest, way, parameters, 4);
  const auto again = drive_stem_frames(forest, way, parameters, 4);
  REQUIRE(frames.size() == again.size());
  for (std::size_t i = 0; i < frames.size(); ++i) {
    REQUIRE(frames[i].stems.size() == again[i].stems.size());
    for (std::size_t k = 0; k < frames[i].stems.size(); ++k)
      CHECK(frames[i].stems[k].position_m == again[i].stems[k].position_m);
  }

  parameters.visit = 1;
  const auto first = seen_trunks(grid, frames);
  const auto other = seen_trunks(grid, drive_stem_frames(forest, way, parameters, 4));
  const auto shared = static_cast<double>(
      std::ranges::count_if(first, [&](std::uint32_t trunk) { return other.contains(trunk); }));
  REQUIRE(first.size() > 150);
  // 0.64 of the trunks that both could see; some are in view of one drive's frames only.
  CHECK(shared / static_cast<double>(first.size()) > 0.52);
  CHECK(shared / static_cast<double>(first.size()) < 0.72);
}

TEST_CASE("Nearer trunks hide those behind", "[stem-frames]") {
  sim::Forest forest = small_forest(3);
  forest.radii_m.assign(forest.trunks_m.size(), 0.25);
  const sim::Route way = make_stem_way(StemWay::kWander, forest, 100.0, 5);
  StemDriveParameters parameters = exact();
  parameters.detector.seen_share = 1.0;
  const auto frames = drive_stem_frames(forest, way, parameters, 5);
  const sim::PointGrid grid(forest.trunks_m, 25.0);
  std::size_t in_range = 0, seen = 0;
  for (const model::StemFrame& frame : frames) {
    in_range += grid.within(frame.world_T_sensor.translation().head<2>(), 25.0).size();
    seen += frame.stems.size();
    // None of those seen stands right behind another one that is seen.
    for (const model::Stem& a : frame.stems) {
      for (const model::Stem& b : frame.stems) {
        const Eigen::Vector2d p = model::level_R_sensor(frame).topRows<2>() * a.position_m;
        const Eigen::Vector2d q = model::level_R_sensor(frame).topRows<2>() * b.position_m;
        if (q.norm() < p.norm() + 0.5) continue;
        const double off = std::abs(p.x() * q.y() - p.y() * q.x()) / (p.norm() * q.norm());
        CHECK_FALSE((p.dot(q) > 0.0 && off < 0.2 * 0.25 / p.norm()));
      }
    }
  }
  CHECK(seen < in_range);
  CHECK(static_cast<double>(seen) > 0.6 * static_cast<double>(in_range));
}

TEST_CASE("Laps and the way back come near what was driven before", "[stem-frames]") {
  const sim::Forest forest = small_forest(4);
  for (const StemWay kind : {StemWay::kLaps, StemWay::kThereAndBack}) {
    const sim::Route way = make_stem_way(kind, forest, 600.0, 6);
    const auto frames = drive_stem_frames(forest, way, {}, 6);
    REQUIRE(frames.size() > 200);
    std::size_t near = 0;
    for (std::size_t i = 0; i < frames.size(); ++i) {
      const Eigen::Vector3d here = frames[i].world_T_sensor.translation();
      CHECK(here.x() > forest.low_m.x());
      CHECK(here.y() < forest.high_m.y());
      for (std::size_t k = 0; k + 50 <= i; ++k) {
        if ((frames[k].world_T_sensor.translation() - here).norm() > 5.0) continue;
        ++near;
        break;
      }
    }
    CHECK(static_cast<double>(near) > 0.3 * static_cast<double>(frames.size()));
  }
}

TEST_CASE("A recorded way is shrunk to the forest, its shape kept", "[stem-frames]") {
  const sim::Forest forest = small_forest(5);
  std::vector<Eigen::Vector2d> recorded;
  for (int i = 0; i <= 400; ++i) recorded.emplace_back(5.0 * i, 300.0 * std::sin(0.02 * i));
  const sim::Route way = fit_stem_way(recorded, forest);
  for (const Eigen::Vector2d& place : way.places(2.0)) {
    CHECK(place.x() > forest.low_m.x());
    CHECK(place.x() < forest.high_m.x());
    CHECK(place.y() > forest.low_m.y());
    CHECK(place.y() < forest.high_m.y());
  }
  CHECK(way.length_m() > 200.0);
  CHECK_THROWS_AS(fit_stem_way(std::span(recorded).first(1), forest), std::runtime_error);
  CHECK_FALSE(stem_way("circle"));
}
