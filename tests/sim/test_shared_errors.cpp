// Errors that detections share: their size, their correlation, and that they change nothing else.
#include "sim/shared_errors.hpp"

#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>
#include <random>

#include "sim/drive.hpp"
#include "sim/inertial_drive.hpp"
#include "sim/random_streams.hpp"
#include "sim/stem_frames.hpp"
#include "tests/catch.hpp"

using namespace understory;
using namespace understory::sim;
using std::numbers::pi;

namespace {

/// Mean product of pairs of numbers, for a correlation.
struct Products {
  double sum = 0.0;
  int count = 0;
  void add(const Eigen::Vector2d& a, const Eigen::Vector2d& b) {
    sum += a.dot(b);
    count += 2;
  }
  double mean() const { return sum / count; }
  /// Four standard deviations of the mean, of products of unit variance.
  double tolerance() const { return 4.0 * std::sqrt(2.0 / count); }
};

Eigen::Vector2d error_of(const SharedErrors& errors, std::uint32_t landmark, double bearing_rad,
                         double range_m, double along_m) {
  const Eigen::Vector2d position =
      range_m * Eigen::Vector2d(std::cos(bearing_rad), std::sin(bearing_rad));
  return errors.error_m(landmark, position, geometry::SE2(), along_m);
}

Forest few_hundred_trunks(std::uint64_t seed) {
  ForestParameters parameters = forest_parameters(ForestKind::kIntermediate);
  parameters.side_m = 250.0;
  auto random = random_stream(seed, Stream::kForest);
  return make_forest(parameters, random);
}

StemDriveParameters stems_without_noise() {
  StemDriveParameters parameters;
  parameters.detector.position_sigma_m = 0.0;
  parameters.detector.false_per_frame = 0.0;
  parameters.detector.seen_share = 1.0;
  parameters.detector.detection = 1.0;
  return parameters;
}

Eigen::Vector2d stem_in_world(const model::StemFrame& frame, const model::Stem& stem) {
  return (frame.world_T_sensor * stem.position_m).head<2>();
}

/// Residuals of one trunk, by frame.
using TrunkResiduals = std::map<std::int64_t, Eigen::Vector2d>;

/// Against the mean place of the detections, all that is known of a real trunk's place.
TrunkResiduals about_mean(TrunkResiduals residuals) {
  Eigen::Vector2d mean = Eigen::Vector2d::Zero();
  for (const auto& [frame, residual] : residuals) mean += residual;
  mean /= static_cast<double>(residuals.size());
  for (auto& [frame, residual] : residuals) residual -= mean;
  return residuals;
}

/// Residuals of the stems of a drive against their true places, by trunk.
std::map<std::uint32_t, TrunkResiduals> residuals_of(const Forest& forest,
                                                     const std::vector<model::StemFrame>& frames) {
  const PointGrid grid(forest.trunks_m, 10.0);
  std::map<std::uint32_t, TrunkResiduals> residuals;
  for (const model::StemFrame& frame : frames) {
    for (const model::Stem& stem : frame.stems) {
      const Eigen::Vector2d at = stem_in_world(frame, stem);
      const auto trunk = grid.nearest(at);
      if (!trunk || trunk->distance_m > 0.4) continue;
      residuals[trunk->index][frame.number] = at - forest.trunks_m[trunk->index];
    }
  }
  return residuals;
}

}  // namespace

TEST_CASE("A landmark's errors along the path have the stated deviation and correlation",
          "[shared-errors]") {
  SharedErrorParameters parameters;
  parameters.along_sigma_m = GENERATE(0.02, 0.2);
  parameters.along_length_m = GENERATE(2.0, 30.0);
  const double variance = parameters.along_sigma_m * parameters.along_sigma_m;
  std::mt19937_64 random(7);
  for (const double lengths : {0.0, 0.2, 0.7, 1.5, 20.0}) {
    Products products, with_another;
    for (std::uint64_t seed = 0; seed < 3000; ++seed) {
      const SharedErrors errors(parameters, 1, seed);
      const double along_m = uniform(random, 0.0, 5000.0);
      const double later_m = along_m + lengths * parameters.along_length_m;
      const Eigen::Vector2d here = error_of(errors, 3, 0.4, 10.0, along_m);
      products.add(here, error_of(errors, 3, 0.4, 10.0, later_m));
      with_another.add(here, error_of(errors, 4, 0.4, 10.0, later_m));
    }
    CHECK(products.mean() / variance ==
          Approx(std::max(0.0, 1.0 - lengths)).margin(products.tolerance()));
    CHECK(with_another.mean() / variance == Approx(0.0).margin(products.tolerance()));
  }
}

TEST_CASE("Errors by direction come back on a later pass and in another drive", "[shared-errors]") {
  SharedErrorParameters parameters;
  parameters.direction_sigma_m = 0.03;
  parameters.direction_harmonics = GENERATE(1, 4, 9);
  const double variance = parameters.direction_sigma_m * parameters.direction_sigma_m;
  std::mt19937_64 random(8);
  for (const double angle : {0.0, 0.1, 0.5, 2.0, pi}) {
    Products products;
    for (std::uint64_t seed = 0; seed < 3000; ++seed) {
      const SharedErrors today(parameters, seed, 2 * seed),
          tomorrow(parameters, seed, 2 * seed + 1);
      const double bearing = uniform(random, -pi, pi);
      // The direction is that in the world, whatever the heading.
      const geometry::SE2 pose(5.0, -3.0, uniform(random, -pi, pi));
      const auto seen = [&](const SharedErrors& errors, double direction, double range_m,
                            double along_m) {
        const Eigen::Vector2d away(std::cos(direction), std::sin(direction));
        return Eigen::Vector2d(
            pose.rotation() *
            errors.error_m(9, pose.rotation().transpose() * range_m * away, pose, along_m));
      };
      const Eigen::Vector2d first = seen(today, bearing, 8.0, 12.0);
      CHECK((first - error_of(today, 9, bearing, 20.0, 500.0)).norm() < 1e-12);
      products.add(first, seen(tomorrow, bearing + angle, 11.0, 800.0));
    }
    double wanted = 0.0;
    for (int k = 1; k <= parameters.direction_harmonics; ++k) wanted += std::cos(k * angle);
    CHECK(products.mean() / variance ==
          Approx(wanted / parameters.direction_harmonics).margin(products.tolerance()));
  }
}

TEST_CASE("Biases by range and bearing are as stated", "[shared-errors]") {
  SharedErrorParameters parameters;
  parameters.radial_bias_share = -7e-4;
  parameters.bearing_bias_rad = 2e-3;
  const SharedErrors errors(parameters, 1, 2);
  for (const double bearing : {-2.5, -1.0, 0.0, 0.3, 1.6, 3.0}) {
    for (const double range_m : {1.0, 10.0, 25.0}) {
      const Eigen::Vector2d error = error_of(errors, 5, bearing, range_m, 40.0);
      const Eigen::Vector2d along(std::cos(bearing), std::sin(bearing));
      CHECK(error.dot(along) == Approx(-7e-4 * range_m));
      CHECK(error.dot(geometry::perpendicular(along)) ==
            Approx(2e-3 * range_m * std::sin(bearing)).margin(1e-12));
    }
  }
}

TEST_CASE("The level's error displaces all detections of a scan alike, by their height",
          "[shared-errors]") {
  SharedErrorParameters parameters;
  parameters.level_sigma_rad = 0.01;
  parameters.level_length_m = 20.0;
  parameters.level_height_m = 2.0;
  Products now, later;
  for (std::uint64_t seed = 0; seed < 3000; ++seed) {
    const SharedErrors errors(parameters, 1, seed);
    const Eigen::Vector2d one = error_of(errors, 1, 0.5, 10.0, 33.0);
    CHECK(one == error_of(errors, 2, -2.0, 20.0, 33.0));
    CHECK(one == errors.level_error_m(33.0));
    now.add(one, one);
    later.add(one, errors.level_error_m(48.0));
  }
  CHECK(now.mean() / 4e-4 == Approx(1.0).margin(now.tolerance()));
  CHECK(later.mean() / 4e-4 == Approx(0.25).margin(now.tolerance()));
}

TEST_CASE("A drive misses the stated share of landmarks from end to end, another drive others",
          "[shared-errors]") {
  const Forest forest = few_hundred_trunks(11);
  const Route way = make_stem_way(StemWay::kLaps, forest, 800.0, 3);
  StemDriveParameters parameters = stems_without_noise();
  const auto all = residuals_of(forest, drive_stem_frames(forest, way, parameters, 3));
  parameters.detector.shared.missed_share = 0.3;
  const auto today = residuals_of(forest, drive_stem_frames(forest, way, parameters, 3));
  parameters.visit = 1;
  const auto tomorrow = residuals_of(forest, drive_stem_frames(forest, way, parameters, 3));

  double seen = 0.0, in_both = 0.0;
  for (const auto& [trunk, residuals] : today) {
    ++seen;
    if (tomorrow.contains(trunk)) ++in_both;
    // What is seen at all is seen in all frames in which it was seen without misses.
    CHECK(residuals.size() == all.at(trunk).size());
  }
  REQUIRE(all.size() > 200);
  CHECK(seen / static_cast<double>(all.size()) == Approx(0.7).margin(0.1));
  CHECK(in_both / seen == Approx(0.7).margin(0.1));
}

TEST_CASE("Shared errors are what they add to a drive: nothing else changes", "[shared-errors]") {
  const Forest forest = few_hundred_trunks(12);
  const Route way = make_stem_way(StemWay::kWander, forest, 150.0, 4);
  StemDriveParameters parameters;
  const auto without = drive_stem_frames(forest, way, parameters, 4);
  SharedErrorParameters& shared = parameters.detector.shared;
  // Where no part is on, its other figures do nothing.
  shared.along_length_m = 1.0;
  shared.direction_harmonics = 7;
  shared.level_height_m = 9.0;
  const auto still_without = drive_stem_frames(forest, way, parameters, 4);
  shared = measured_shared_errors();
  const auto with = drive_stem_frames(forest, way, parameters, 4);

  REQUIRE(with.size() == without.size());
  double largest_m = 0.0;
  for (std::size_t i = 0; i < with.size(); ++i) {
    REQUIRE(with[i].stems.size() == without[i].stems.size());
    CHECK(with[i].world_T_sensor.matrix() == without[i].world_T_sensor.matrix());
    for (std::size_t k = 0; k < with[i].stems.size(); ++k) {
      CHECK(still_without[i].stems[k].position_m == without[i].stems[k].position_m);
      CHECK(with[i].stems[k].diameter_m == without[i].stems[k].diameter_m);
      const double off_m = (with[i].stems[k].position_m - without[i].stems[k].position_m).norm();
      largest_m = std::max(largest_m, off_m);
    }
  }
  CHECK(largest_m > 0.05);
  CHECK(largest_m < 0.4);
}

TEST_CASE("Residuals of simulated stems are those of the recorded walk", "[shared-errors]") {
  const Forest forest = few_hundred_trunks(13);
  StemDriveParameters parameters = stems_without_noise();
  parameters.detector.position_sigma_m = kMeasuredIndependentSigmaM;
  parameters.detector.shared = measured_shared_errors();
  std::map<std::int64_t, Products> by_lag;
  std::map<int, std::pair<double, int>> bias_by_range;
  for (std::uint64_t seed = 1; seed <= 8; ++seed) {
    const Route way = make_stem_way(StemWay::kWander, forest, 600.0, seed);
    const auto frames = drive_stem_frames(forest, way, parameters, seed);
    for (const auto& [trunk, of_trunk] : residuals_of(forest, frames)) {
      if (of_trunk.size() < 10) continue;
      const TrunkResiduals residuals = about_mean(of_trunk);
      for (const auto& [frame, residual] : residuals) {
        for (const std::int64_t lag : {0, 1, 2, 3, 5}) {
          const auto later = residuals.find(frame + lag);
          if (later != residuals.end()) by_lag[lag].add(residual, later->second);
        }
        const Eigen::Vector2d away =
            forest.trunks_m[trunk] -
            frames[static_cast<std::size_t>(frame)].world_T_sensor.translation().head<2>();
        auto& [sum_m, count] = bias_by_range[static_cast<int>(away.norm() / 5.0)];
        sum_m += of_trunk.at(frame).dot(away.normalized());
        ++count;
      }
    }
  }

  const double variance = by_lag[0].mean();
  CHECK(std::sqrt(variance) == Approx(0.05).margin(0.005));
  CHECK(by_lag[1].mean() / variance == Approx(0.75).margin(0.05));
  CHECK(by_lag[2].mean() / variance == Approx(0.5).margin(0.05));
  CHECK(by_lag[3].mean() / variance == Approx(0.3).margin(0.05));
  CHECK(by_lag[5].mean() / variance == Approx(-0.1).margin(0.05));
  for (int bin = 1; bin < 5; ++bin) {
    const auto& [sum_m, count] = bias_by_range.at(bin);
    CHECK(sum_m / count == Approx(-6e-4 * (5.0 * bin + 2.5)).margin(0.004));
  }
}

TEST_CASE("Scans of a drive share errors whatever was asked before", "[shared-errors]") {
  DriveParameters parameters;
  parameters.forest = forest_parameters(ForestKind::kIntermediate);
  parameters.forest.side_m = 300.0;
  parameters.path.length_m = 100.0;
  parameters.path.interval = 1.0;
  parameters.sensor.position_sigma_m = 0.0;
  parameters.sensor.detection_probability = 1.0;
  const Drive exact(parameters, 5);
  parameters.sensor.shared = measured_shared_errors();
  const Drive forwards(parameters, 5), backwards(parameters, 5);
  std::vector<SimulatedScan> scans;
  for (std::size_t k = 0; k < forwards.size(); ++k) scans.push_back(forwards.scan(k));
  const SharedErrors errors(parameters.sensor.shared, 5, 5);

  double squared = 0.0;
  int count = 0;
  for (std::size_t k = backwards.size(); k-- > 0;) {
    const SimulatedScan scan = backwards.scan(k);
    REQUIRE(scan.trunks == scans[k].trunks);
    for (std::size_t i = 0; i < scan.trunks.size(); ++i) {
      const Eigen::Vector2d shown = scan.scan.detections[i].position_m.head<2>();
      CHECK(shown == scans[k].scan.detections[i].position_m.head<2>());
      const Eigen::Vector2d place =
          scan.world_T_vehicle.inverse() * forwards.forest().trunks_m[scan.trunks[i]];
      const Eigen::Vector2d error = shown - place;
      CHECK(
          (error - errors.error_m(scan.trunks[i], place, scan.world_T_vehicle, forwards.along_m(k)))
              .norm() < 1e-9);
      squared += error.squaredNorm();
      count += 2;
    }
    CHECK(exact.scan(k).trunks.size() > 0.9 * static_cast<double>(scan.trunks.size()));
  }
  REQUIRE(count > 5000);
  CHECK(std::sqrt(squared / count) == Approx(0.055).margin(0.006));
}

TEST_CASE("An inertial drive takes shared errors on top of its own", "[shared-errors]") {
  const TrunkField field = [] {
    ForestParameters forest = forest_parameters(ForestKind::kIntermediate);
    forest.side_m = 600.0;
    return make_trunk_field(forest, 3);
  }();
  InertialDriveParameters parameters;
  parameters.stationary_s = 0.0;
  parameters.loop_length_m = 600.0;
  InertialDrive without(parameters, field, 9);
  parameters.shared = measured_shared_errors();
  InertialDrive with(parameters, field, 9);
  const SharedErrors errors(parameters.shared, 9, 9);
  for (int k = 0; k < 100; ++k) {
    const DriveStep plain = without.next(), step = with.next();
    REQUIRE(step.trunks == plain.trunks);
    for (std::size_t i = 0; i < step.trunks.size(); ++i) {
      if (step.trunks[i] < 0) continue;
      const auto trunk = static_cast<std::uint32_t>(step.trunks[i]);
      const Eigen::Vector2d place = step.world_T_vehicle.inverse() * field.forest.trunks_m[trunk];
      const Eigen::Vector2d added =
          (step.scan.detections[i].position_m - plain.scan.detections[i].position_m).head<2>();
      CHECK((added - errors.error_m(trunk, place, step.world_T_vehicle, step.driven_m)).norm() <
            1e-9);
    }
  }
}

TEST_CASE("Shared errors that cannot be are refused", "[shared-errors]") {
  const auto refused = [](auto change) {
    SharedErrorParameters parameters;
    change(parameters);
    CHECK_THROWS_AS(SharedErrors(parameters, 1, 1), std::invalid_argument);
  };
  refused([](auto& p) { p.along_sigma_m = -0.1; });
  refused([](auto& p) { p.direction_sigma_m = -0.1; });
  refused([](auto& p) { p.level_sigma_rad = -0.1; });
  refused([](auto& p) { p.along_length_m = 0.0; });
  refused([](auto& p) { p.level_length_m = std::nan(""); });
  refused([](auto& p) { p.direction_harmonics = 0; });
}

TEST_CASE("Trunks that errors bring into range are within the reach of the drive",
          "[shared-errors]") {
  DriveParameters parameters;
  parameters.path.length_m = 60.0;
  parameters.sensor.shared.along_sigma_m = 1.0;
  const Drive drive(parameters, 3);
  std::size_t farther = 0;
  for (std::size_t k = 0; k < drive.size(); ++k) {
    for (const std::uint32_t trunk : drive.scan(k).trunks) {
      const Eigen::Vector2d exact =
          drive.world_T_vehicle()[k].inverse() * drive.forest().trunks_m[trunk];
      CHECK(exact.norm() <= drive.reach_m());
      if (exact.norm() > parameters.sensor.reach_m()) ++farther;
    }
  }
  CHECK(farther > 0);
}
