// Frames found again among many, and frames of elsewhere that must not be.
#include "common/place_recognition/stem_recogniser.hpp"

#include <algorithm>

#include "tests/catch.hpp"
#include "tests/place_recognition/stem_scene.hpp"

using namespace understory;
using namespace understory::place_recognition;

namespace {

constexpr double kSideM = 300.0;

/// Frames on lanes 20 m apart, a frame every 3 m.
std::vector<geometry::SE2> lanes() {
  std::vector<geometry::SE2> poses;
  for (double y = 40.0; y < kSideM - 30.0; y += 20.0) {
    for (double x = 30.0; x < kSideM - 30.0; x += 3.0) poses.emplace_back(x, y, 0.0);
  }
  return poses;
}

struct Mapped {
  std::mt19937_64 random{11};
  test::StemScene scene{random, kSideM};
  std::vector<geometry::SE2> poses = lanes();
  StemRecogniser recogniser;

  explicit Mapped(bool use_diameters = true)
      : recogniser([&] {
          StemRecogniserParameters parameters;
          parameters.noise.use_diameters = use_diameters;
          return parameters;
        }()) {
    for (std::size_t i = 0; i < poses.size(); ++i)
      recogniser.add(static_cast<FrameId>(10 * i), scene.frame(poses[i], {}));
  }
  std::size_t nearest_to(const geometry::SE2& pose) const {
    const auto distance = [&](const geometry::SE2& one) {
      return (one.translation() - pose.translation()).norm();
    };
    return static_cast<std::size_t>(std::ranges::min_element(poses, {}, distance) - poses.begin());
  }
};

}  // namespace

TEST_CASE("A frame is found where it was taken, whatever its heading", "[recogniser]") {
  const bool use_diameters = GENERATE(true, false);
  Mapped mapped(use_diameters);
  std::uniform_real_distribution<double> unit(0.0, 1.0);
  int right = 0;
  int nearest = 0;
  const int queries = 100;
  for (int i = 0; i < queries; ++i) {
    const double x = 40.0 + 200.0 * unit(mapped.random);
    const double y = 60.0 + 180.0 * unit(mapped.random);
    const geometry::SE2 pose(x, y, 6.28 * unit(mapped.random));
    const PlaceAnswer answer = mapped.recogniser.query(mapped.scene.frame(pose, {}));
    REQUIRE(answer.best() != nullptr);
    const auto frame = static_cast<std::size_t>(answer.best()->frame / 10);
    REQUIRE(frame < mapped.poses.size());
    const Eigen::Vector3d error =
        (answer.best()->frame_T_query.inverse() * mapped.poses[frame].inverse() * pose).Log();
    if (error.head<2>().norm() > 1.0) continue;
    ++right;
    CHECK(error.head<2>().norm() < 0.12);
    CHECK(std::abs(error.z()) < 0.01);
    // The answer is the frame nearest to the pose; of two that are as near, either.
    const double nearest_m =
        (mapped.poses[mapped.nearest_to(pose)].translation() - pose.translation()).norm();
    nearest += (mapped.poses[frame].translation() - pose.translation()).norm() < nearest_m + 0.25;
    CHECK(answer.best()->pairs.size() >= 3);
  }
  CHECK(right >= (use_diameters ? 99 : 98));
  CHECK(nearest >= 98);
}

TEST_CASE("Frames of elsewhere are not found", "[recogniser]") {
  Mapped mapped;
  std::mt19937_64 random(12);
  test::StemScene elsewhere(random, kSideM);
  std::uniform_real_distribution<double> place(40.0, kSideM - 40.0);
  for (int i = 0; i < 200; ++i) {
    const double x = place(random);
    const geometry::SE2 pose(x, place(random), 0.1 * i);
    const PlaceAnswer answer = mapped.recogniser.query(elsewhere.frame(pose, {}));
    const bool is_sure =
        answer.best() != nullptr && answer.candidates.front().log10_false_alarm < -3.0;
    CHECK_FALSE(is_sure);
  }
}

TEST_CASE("Only frames up to the newest one allowed are answered", "[recogniser]") {
  Mapped mapped;
  const geometry::SE2 pose = mapped.poses[50] * geometry::SE2(0.5, 0.5, 1.0);
  const auto stems = mapped.scene.frame(pose, {});
  for (const FrameId newest : {FrameId{-1}, FrameId{0}, FrameId{480}, FrameId{505}}) {
    for (const PlaceCandidate& one : mapped.recogniser.query(stems, newest).candidates)
      CHECK(one.frame <= newest);
  }
  CHECK(mapped.recogniser.query(stems, 505).best()->frame == 500);
  CHECK(mapped.recogniser.query(stems, -1).best() == nullptr);
}

TEST_CASE("The same frames give the same answer; few stems give none", "[recogniser]") {
  Mapped a;
  Mapped b;
  const auto stems = a.scene.frame({100.0, 101.0, 1.0}, {});
  const PlaceAnswer first = a.recogniser.query(stems);
  const PlaceAnswer second = b.recogniser.query(stems);
  REQUIRE(first.candidates.size() == second.candidates.size());
  for (std::size_t i = 0; i < first.candidates.size(); ++i) {
    CHECK(first.candidates[i].frame == second.candidates[i].frame);
    CHECK(first.candidates[i].log_ratio == second.candidates[i].log_ratio);
  }
  CHECK(first.nearest == second.nearest);
  CHECK(first.log10_margin > 10.0);

  CHECK(a.recogniser.query({}).best() == nullptr);
  CHECK(a.recogniser.query(std::span(stems).first(2)).best() == nullptr);
  CHECK(StemRecogniser().query(stems).best() == nullptr);
}

TEST_CASE("Likelier candidates come first, and what is kept is six bytes a stem", "[recogniser]") {
  Mapped mapped;
  const PlaceAnswer answer = mapped.recogniser.query(mapped.scene.frame({90.0, 130.0, 2.0}, {}));
  REQUIRE(answer.candidates.size() > 3);
  for (std::size_t i = 1; i < answer.candidates.size(); ++i)
    CHECK(answer.candidates[i - 1].log_ratio >= answer.candidates[i].log_ratio);
  CHECK(mapped.recogniser.size() == mapped.poses.size());
  const double per_frame = static_cast<double>(mapped.recogniser.stored_bytes()) /
                           static_cast<double>(mapped.poses.size());
  CHECK(per_frame > 6.0 * 15);
  CHECK(per_frame < 6.0 * 30);
}
