#include "common/model/detection_noise.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <random>
#include <vector>

#include "common/geometry/se2.hpp"
#include "common/model/archive.hpp"
#include "tests/catch.hpp"

using namespace understory;

namespace {

/// A vehicle that drives past landmarks, whose detections are as noisy as asked.
class Drive {
 public:
  explicit Drive(std::uint64_t seed, int landmarks = 12) : random_(seed) {
    for (int i = 0; i < landmarks; ++i) landmarks_.emplace_back(uniform(-15, 25), uniform(-15, 15));
  }

  /// A scan with noise of `sigma_m` times `factor_at(range)`, stated as `sigma_m`.
  template <class FactorAt>
  model::LandmarkScan next(double sigma_m, FactorAt factor_at) {
    world_T_vehicle_ = world_T_vehicle_ * geometry::SE2(0.1, 0.0, 0.01);
    model::LandmarkScan scan;
    scan.utime = utime_ += 100'000;
    scan.field_of_view.max_range_m = 40.0;
    tracks.clear();
    for (std::size_t i = 0; i < landmarks_.size(); ++i) {
      if (uniform(0, 1) < 0.1) continue;
      const Eigen::Vector2d true_m = world_T_vehicle_.inverse() * landmarks_[i];
      const double sigma = sigma_m * factor_at(true_m.norm());
      model::Detection one;
      one.position_m << true_m.x() + sigma * normal_(random_),
          true_m.y() + sigma * normal_(random_), 0.0;
      one.covariance_m2 = sigma_m * sigma_m * Eigen::Matrix3d::Identity();
      scan.detections.push_back(one);
      tracks.push_back(i + 1);
    }
    return scan;
  }
  double uniform(double from, double to) {
    return std::uniform_real_distribution<double>(from, to)(random_);
  }

  std::vector<std::uint64_t> tracks;  ///< Of the last scan.

 private:
  std::mt19937_64 random_;
  std::normal_distribution<double> normal_;
  std::vector<Eigen::Vector2d> landmarks_;
  geometry::SE2 world_T_vehicle_;
  model::Utime utime_ = 0;
};

constexpr auto kTrunk = model::LandmarkKind::kTrunk;

}  // namespace

TEST_CASE("Noise that is as stated is left as stated", "[noise]") {
  int replaced = 0;
  int scans = 0;
  for (std::uint64_t seed = 1; seed <= 30; ++seed) {
    Drive drive(seed);
    model::DetectionNoise noise;
    for (int k = 0; k < 100; ++k, ++scans) {
      const auto scan = drive.next(0.1, [](double) { return 1.0; });
      noise.add(scan, drive.tracks);
      if (noise.is_misstated()) ++replaced;
    }
  }
  INFO(scans << " scans");
  CHECK(replaced == 0);
}

TEST_CASE("The factor of misstated noise is learned within a few scans", "[noise]") {
  for (const double factor : {0.25, 0.5, 2.0, 4.0}) {
    for (std::uint64_t seed = 1; seed <= 10; ++seed) {
      Drive drive(seed);
      model::DetectionNoise noise;
      for (int k = 0; k < 8; ++k) {
        noise.add(drive.next(0.1, [&](double) { return factor; }), drive.tracks);
      }
      CAPTURE(factor, seed);
      const double early = noise.factor(kTrunk, 8.0) / (factor * factor);
      CHECK(early > 0.4);
      CHECK(early < 2.5);

      for (int k = 0; k < 100; ++k) {
        noise.add(drive.next(0.1, [&](double) { return factor; }), drive.tracks);
      }
      const double late = noise.factor(kTrunk, 8.0) / (factor * factor);
      CHECK(late > 0.75);
      CHECK(late < 1.35);
    }
  }
}

TEST_CASE("Misstated noise is said until it is mended, and again when it changes", "[noise]") {
  for (std::uint64_t seed = 1; seed <= 20; ++seed) {
    Drive drive(seed, 30);
    model::DetectionNoise noise;
    const auto scans_with = [&](int scans, double factor) {
      int adjusting = 0;
      for (int k = 0; k < scans; ++k) {
        noise.add(drive.next(0.05, [&](double) { return factor; }), drive.tracks);
        if (noise.is_adjusting()) ++adjusting;
      }
      return adjusting;
    };
    CAPTURE(seed);
    const int first = scans_with(600, 2.0);
    CHECK(first > 150);
    CHECK(first < 450);
    CHECK(noise.is_misstated());
    CHECK(scans_with(400, 2.0) == 0);

    // A jump is said within some scans; as stated again there is nothing to say.
    const int second = scans_with(1500, 6.0);
    CHECK(second > 150);
    CHECK(second < 800);
    CHECK_FALSE(noise.is_adjusting());
    scans_with(1500, 1.0);
    CHECK_FALSE(noise.is_adjusting());
    CHECK(noise.factor(kTrunk, 8.0) == 1.0);
  }
}

TEST_CASE("Noise that grows with range is learned for each range", "[noise]") {
  Drive drive(3, 60);
  model::DetectionNoise noise;
  const auto factor_at = [](double range_m) { return range_m < 10.0 ? 1.0 : 3.0; };
  for (int k = 0; k < 200; ++k) noise.add(drive.next(0.05, factor_at), drive.tracks);
  CHECK(noise.factor(kTrunk, 5.0) < 1.7);
  CHECK(noise.factor(kTrunk, 15.0) > 6.0);
  CHECK(noise.factor(kTrunk, 15.0) < 12.0);
  CHECK(noise.factor(model::LandmarkKind::kCorner, 15.0) == 1.0);
}

TEST_CASE("Overstated corners shrink where trunks keep what is stated", "[noise]") {
  model::DetectionNoiseParameters parameters;
  parameters.replace_below = 0.0;
  model::DetectionNoise noise(parameters);
  Drive drive(4, 40);
  for (int k = 0; k < 100; ++k) {
    model::LandmarkScan scan = drive.next(0.1, [](double) { return 0.4; });
    for (std::size_t i = 0; i < scan.detections.size(); ++i)
      if (drive.tracks[i] % 2 == 0) scan.detections[i].kind = model::LandmarkKind::kCorner;
    noise.add(scan, drive.tracks);
  }
  CHECK(noise.factor(kTrunk, 8.0) == 1.0);
  CHECK(noise.factor(model::LandmarkKind::kCorner, 8.0) == Approx(0.16).epsilon(0.3));
}

TEST_CASE("Noise shrinks only where its memory is shorter than what is compared", "[noise]") {
  // A tenth of the stated variance, fading by this share from scan to scan.
  for (const double kept : {0.0, 0.5, 0.97}) {
    for (std::uint64_t seed = 1; seed <= 5; ++seed) {
      Drive drive(seed, 20);
      model::DetectionNoise noise;
      std::mt19937_64 random(seed);
      std::normal_distribution<double> normal(0.0, std::sqrt(0.1) * 0.1);
      std::vector<Eigen::Vector2d> errors(20);
      for (auto& error : errors) error = {normal(random), normal(random)};

      int shrunk = 0;
      for (int k = 0; k < 600; ++k) {
        auto scan = drive.next(0.1, [](double) { return 0.0; });
        const double fresh = std::sqrt(1.0 - kept * kept);
        for (auto& error : errors)
          error = kept * error + fresh * Eigen::Vector2d(normal(random), normal(random));
        for (std::size_t i = 0; i < scan.detections.size(); ++i)
          scan.detections[i].position_m.head<2>() += errors[drive.tracks[i] - 1];

        noise.add(scan, drive.tracks);
        if (k >= 200 && noise.factor(kTrunk, 8.0) < 1.0) ++shrunk;
      }

      CAPTURE(kept, seed, shrunk, noise.factor(kTrunk, 8.0));
      if (kept > 0.9) {
        CHECK(shrunk == 0);
      } else {
        // White noise of the same power has (1 + kept) / (1 - kept) times the variance.
        CHECK(noise.factor(kTrunk, 8.0) == Approx(0.1 * (1.0 + kept) / (1.0 - kept)).epsilon(0.35));
      }
    }
  }
}

TEST_CASE("Errors that fade over fifty scans soon count as stated, and more once that is seen",
          "[noise]") {
  // The mean of so many independent errors, of which one is renewed at each scan.
  constexpr std::size_t kMemory = 48;
  constexpr double kSigma_m = 0.1;
  for (std::uint64_t seed = 1; seed <= 5; ++seed) {
    Drive drive(seed, 40);
    model::DetectionNoise noise;
    std::mt19937_64 random(seed);
    std::normal_distribution<double> normal(0.0, kSigma_m / std::sqrt(double(kMemory)));
    const auto fresh = [&] { return Eigen::Vector2d(normal(random), normal(random)); };
    std::vector<std::array<Eigen::Vector2d, kMemory>> shares(40);
    for (auto& landmark : shares) std::ranges::generate(landmark, fresh);

    for (std::size_t k = 0; k < 400; ++k) {
      auto scan = drive.next(kSigma_m, [](double) { return 0.0; });
      for (auto& landmark : shares) landmark[k % kMemory] = fresh();
      for (std::size_t i = 0; i < scan.detections.size(); ++i)
        for (const Eigen::Vector2d& share : shares[drive.tracks[i] - 1])
          scan.detections[i].position_m.head<2>() += share;
      noise.add(scan, drive.tracks);
      CAPTURE(seed, k);
      if (k >= 20) CHECK(noise.factor(kTrunk, 8.0) >= 1.0);
    }
    // What 16 scans show of them: a variogram of h / 48, power 16 * 16 / 48.
    CAPTURE(seed);
    CHECK(noise.factor(kTrunk, 8.0) == Approx(256.0 / 48.0).epsilon(0.4));
  }
}

TEST_CASE("One wrong detection in fifty does not pass for noise", "[noise]") {
  Drive drive(4, 50);
  model::DetectionNoise noise;
  for (int k = 0; k < 200; ++k) {
    auto scan = drive.next(0.1, [](double) { return 1.0; });
    if (!scan.detections.empty())
      scan.detections.front().position_m.x() += drive.uniform(-3.0, 3.0);
    noise.add(scan, drive.tracks);
  }
  CHECK_FALSE(noise.is_misstated());
}

TEST_CASE("Corrected covariances are symmetric, and learned noise is saved", "[noise]") {
  Drive drive(5);
  model::DetectionNoise noise;
  for (int k = 0; k < 50; ++k) noise.add(drive.next(0.1, [](double) { return 3.0; }), drive.tracks);
  auto scan = drive.next(0.1, [](double) { return 3.0; });
  scan.detections.front().covariance_m2(0, 2) = scan.detections.front().covariance_m2(2, 0) = 0.001;
  const auto corrected = noise.corrected(scan);
  const Eigen::Matrix3d& covariance = corrected.detections.front().covariance_m2;
  CHECK(covariance == covariance.transpose());
  CHECK(covariance(0, 0) > 0.05);
  CHECK(covariance(2, 2) == scan.detections.front().covariance_m2(2, 2));

  state::Writer out;
  out(noise);
  model::DetectionNoise loaded;
  state::Reader in(out.bytes());
  in(loaded);
  CHECK(in.is_at_end());
  CHECK(loaded.factor(kTrunk, 8.0) == noise.factor(kTrunk, 8.0));
}

TEST_CASE("Noise is not learned where the configuration says so", "[noise]") {
  Drive drive(6);
  model::DetectionNoise noise({.learn = false});
  for (int k = 0; k < 50; ++k) noise.add(drive.next(0.1, [](double) { return 4.0; }), drive.tracks);
  CHECK_FALSE(noise.is_misstated());
  CHECK_FALSE(noise.is_new());
}
