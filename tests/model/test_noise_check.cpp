#include "common/model/noise_check.hpp"

#include <cmath>
#include <random>

#include "common/geometry/se2.hpp"
#include "common/model/archive.hpp"
#include "tests/catch.hpp"

using namespace understory;

namespace {

constexpr double kSigma_m = 0.1;

/// A vehicle that drives past landmarks whose detections have `factor` times the stated sigma, with
/// what is learned of it.
struct NoisyDrive {
  explicit NoisyDrive(std::uint64_t seed) : random(seed) {
    std::uniform_real_distribution<double> where(-20.0, 20.0);
    for (int i = 0; i < 15; ++i) landmarks.emplace_back(where(random), where(random));
  }

  void go(double factor) {
    world_T_vehicle = world_T_vehicle * geometry::SE2(0.1, 0.0, 0.02);
    model::LandmarkScan scan;
    scan.utime = utime += 100'000;
    std::vector<std::uint64_t> tracks;
    for (std::size_t i = 0; i < landmarks.size(); ++i) {
      model::Detection one;
      one.position_m.head<2>() =
          world_T_vehicle.inverse() * landmarks[i] +
          factor * kSigma_m * Eigen::Vector2d(normal(random), normal(random));
      one.covariance_m2 = kSigma_m * kSigma_m * Eigen::Matrix3d::Identity();
      scan.detections.push_back(one);
      tracks.push_back(i + 1);
    }
    noise.add(scan, tracks);
    check.add(scan, tracks, noise);
  }
  /// How many of the next scans left the verdict open.
  int open_of(int scans, double factor) {
    int open = 0;
    for (int k = 0; k < scans; ++k) {
      go(factor);
      if (check.verdict().is_open()) ++open;
    }
    return open;
  }

  std::mt19937_64 random;
  std::normal_distribution<double> normal;
  std::vector<Eigen::Vector2d> landmarks;
  geometry::SE2 world_T_vehicle;
  model::Utime utime = 0;
  model::DetectionNoise noise;
  model::NoiseCheck check;
};

}  // namespace

TEST_CASE("A correct statement is never in question", "[noise]") {
  for (std::uint64_t seed = 1; seed <= 20; ++seed) {
    NoisyDrive drive(seed);
    CHECK(drive.open_of(200, 1.0) == 0);
    CHECK_FALSE(drive.check.verdict().is_corrected);
  }
}

TEST_CASE("A wrong statement is told until what takes its place explains the scans", "[noise]") {
  for (const double factor : {0.25, 0.5, 2.0, 4.0}) {
    for (std::uint64_t seed = 1; seed <= 10; ++seed) {
      INFO("factor " << factor << ", seed " << seed);
      NoisyDrive drive(seed);
      CHECK(drive.open_of(60, factor) >= 10);
      CHECK(drive.open_of(400, factor) == 0);

      const model::NoiseVerdict& verdict = drive.check.verdict();
      CHECK(verdict.is_misstated);
      CHECK(verdict.is_corrected);
      CHECK(std::abs(std::log(verdict.sigma_factor / factor)) < 0.25);
    }
  }
}

TEST_CASE("A statement that becomes right, or wrong by more, is judged anew", "[noise]") {
  for (std::uint64_t seed = 1; seed <= 10; ++seed) {
    INFO("seed " << seed);
    NoisyDrive drive(seed);
    drive.open_of(100, 2.0);
    drive.open_of(100, 1.0);
    CHECK_FALSE(drive.check.verdict().is_misstated);

    // Eight times the stated noise all of a sudden: told again, and over again.
    CHECK(drive.open_of(60, 8.0) >= 1);
    drive.open_of(100, 8.0);
    CHECK(drive.open_of(100, 8.0) == 0);
    CHECK(drive.check.verdict().is_corrected);
  }
}

TEST_CASE("A correction is news once, and again where its factor changes by a quarter", "[noise]") {
  model::NoiseNews news;
  model::NoiseVerdict verdict;
  CHECK_FALSE(news.add(verdict));
  verdict = {true, false, 2.0, model::LandmarkKind::kTrunk, 15.0};
  CHECK_FALSE(news.add(verdict));
  verdict.is_corrected = true;
  const auto text = news.add(verdict);
  REQUIRE(text);
  CHECK(text->find("trunks 15 m away have 2.00 times the stated sigma") != std::string::npos);
  verdict.sigma_factor = 2.2;
  CHECK_FALSE(news.add(verdict));
  verdict.sigma_factor = 2.6;
  CHECK(news.add(verdict));
}
