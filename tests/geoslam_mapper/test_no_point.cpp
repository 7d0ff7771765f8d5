// A thing that looks elsewhere from the other side: one landmark, but no point.
#include <random>
#include <vector>

#include "services/geoslam_mapper/smoothing/one_map.hpp"
#include "tests/catch.hpp"
#include "tests/geoslam_mapper/simple_keyframe.hpp"

using namespace understory;
using namespace understory::geoslam_mapper;
using namespace understory::geoslam_mapper::smoothing;

namespace {

constexpr double kStep_m = 2.0;
constexpr double kRange_m = 20.0;
constexpr double kSigma_m = 0.01;
constexpr double kRadius_m = 0.25;
constexpr int kKeyframes = 40;
const Eigen::Vector2d kThing_m(40.0, 6.0);
/// Where it seems to be moves by this as the vehicle passes it.
const Eigen::Vector2d kMoves_m(0.15, 0.0);

/// Straight on among eight trees and the thing.
class Lane {
 public:
  explicit Lane(std::uint64_t seed) : random_(seed) {}

  static geometry::SE2 pose(int i) { return {kStep_m * i, 0.0, 0.0}; }
  model::Odometry odometry(int i) {
    return test::simple_odometry(i, kStep_m, {0.02, 0.01, 2e-3},
                                 {normal_(random_), normal_(random_), normal_(random_)});
  }
  model::Keyframe keyframe(int i) {
    model::Keyframe keyframe = test::simple_keyframe(i, kRange_m);
    for (int k = 0; k < 8; ++k) see({10.0 * k + 5.0, k % 2 == 0 ? 9.0 : -8.0}, i, 0.1, keyframe);
    const bool is_behind = pose(i).x() > kThing_m.x();
    see(is_behind ? Eigen::Vector2d(kThing_m + kMoves_m) : kThing_m, i, kRadius_m, keyframe);
    return keyframe;
  }

 private:
  void see(const Eigen::Vector2d& at_m, int i, double radius_m, model::Keyframe& keyframe) {
    const Eigen::Vector2d seen_m = pose(i).inverse() * at_m;
    if (seen_m.norm() > kRange_m) return;
    keyframe.landmarks.push_back(test::simple_tree(
        seen_m + kSigma_m * Eigen::Vector2d(normal_(random_), normal_(random_)), kSigma_m));
    keyframe.landmarks.back().radius_m = radius_m;
  }

  std::mt19937_64 random_;
  std::normal_distribution<double> normal_;
};

}  // namespace

TEST_CASE("A thing that looks elsewhere from the other side bends nothing", "[doubles]") {
  for (std::uint64_t seed = 1; seed <= 10; ++seed) {
    CAPTURE(seed);
    SmoothingMapperParameters parameters;
    parameters.use_odometry = true;
    parameters.gyro_walk = 0.0;
    parameters.condense_m = 0.0;
    OneMap map(parameters);
    Lane lane(seed);
    for (int i = 0; i < kKeyframes; ++i) {
      if (i > 0) map.add(lane.odometry(i));
      (void)map.add(lane.keyframe(i));
    }

    // One landmark, and what was seen last in the next keyframe's turn; all observations agree.
    const GlobalMap& made = map.map();
    CHECK(made.landmarks.all().size() <= 10);
    double most = 0.0;
    for (const auto& [id, landmark] : made.landmarks.all())
      for (const NodeIndex node : landmark.nodes)
        if (made.graph.node(node).observations().contains(id))
          most = std::max(most, made.graph.chi2(node, id));
    CHECK(most < parameters.outlier_chi2);
  }
}
