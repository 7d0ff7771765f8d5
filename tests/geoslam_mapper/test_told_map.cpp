// The map that others get has the error of each landmark and keyframe.
#include <Eigen/Cholesky>
#include <random>

#include "services/geoslam_mapper/smoothing/smoothing_mapper.hpp"
#include "services/keyframer/joint/joint_keyframer.hpp"
#include "sim/drive.hpp"
#include "tests/catch.hpp"

using namespace understory;
using namespace understory::geoslam_mapper;
using namespace understory::geoslam_mapper::smoothing;

namespace {

sim::Drive circle(std::uint64_t seed) {
  sim::DriveParameters parameters;
  parameters.forest = sim::forest_parameters(sim::ForestKind::kIntermediate);
  parameters.forest.side_m = 400.0;
  parameters.path.kind = sim::PathKind::kCircle;
  parameters.path.length_m = 150.0;
  return {parameters, seed};
}

/// Sum of squared normalised errors, and how many numbers they have.
struct Consistency {
  double sum = 0.0;
  double freedom = 0.0;
  double worst = 0.0;  ///< Of one landmark or keyframe.

  template <class Error, class Covariance>
  void add(const Error& error, const Covariance& covariance) {
    const double one = error.dot(covariance.ldlt().solve(error));
    sum += one;
    freedom += static_cast<double>(error.size());
    worst = std::max(worst, one);
  }
  double mean() const { return sum / freedom; }
};

struct Told {
  Consistency landmarks;
  Consistency keyframes;
};

void compare(const SmoothingMapper& mapper, const sim::Drive& drive, Told& told) {
  const geometry::SE2 map_T_world = drive.world_T_vehicle().front().inverse();
  for (const model::KeyframePose& pose : mapper.trajectory()) {
    const auto scan = 8 * static_cast<std::size_t>(pose.keyframe_sequence);
    const geometry::SE2 truth = map_T_world * drive.world_T_vehicle()[scan];
    if (pose.covariance.isZero(0.0)) continue;  // the map's origin
    told.keyframes.add((truth.inverse() * pose.map_T_vehicle).Log(), pose.covariance);
  }

  for (const model::MapLandmark& landmark : mapper.landmarks()) {
    double nearest = 1.0;
    Eigen::Vector2d error;
    for (const Eigen::Vector2d& trunk : drive.forest().trunks_m) {
      const Eigen::Vector2d off = landmark.position_m - map_T_world * trunk;
      if (off.norm() >= nearest) continue;
      nearest = off.norm();
      error = off;
    }
    REQUIRE(nearest < 1.0);
    told.landmarks.add(error, landmark.covariance_m2);
  }
}

}  // namespace

TEST_CASE("Landmarks and keyframes are told with the error that they have", "[mapper][told]") {
  Told told;
  for (std::uint64_t seed = 700; seed < 710; ++seed) {
    const sim::Drive drive = circle(seed);
    keyframer::joint::JointKeyframer keyframer({});
    SmoothingMapper mapper(SmoothingMapperParameters{});
    for (std::size_t k = 0; k < drive.size(); ++k)
      if (const auto keyframe = keyframer.add(drive.scan(k).scan)) mapper.add(*keyframe);
    compare(mapper, drive, told);
  }
  // 1 is exact; the errors of one drive are correlated, and a landmark may have a wrong member.
  INFO("landmarks " << told.landmarks.mean() << " of " << told.landmarks.freedom / 2 << ", worst "
                    << told.landmarks.worst << "; keyframes " << told.keyframes.mean() << " of "
                    << told.keyframes.freedom / 3 << ", worst " << told.keyframes.worst);
  CHECK(told.landmarks.mean() > 0.8);
  CHECK(told.landmarks.mean() < 1.25);
  CHECK(told.keyframes.mean() > 0.8);
  CHECK(told.keyframes.mean() < 1.25);
}

TEST_CASE("Covariances of some landmarks are those of the whole map", "[mapper][told]") {
  const sim::Drive drive = circle(711);
  keyframer::joint::JointKeyframer keyframer({});
  SmoothingMapperParameters parameters;
  parameters.scale_sigma = 1e-3;
  SmoothingMapper mapper(parameters);
  for (std::size_t k = 0; k < drive.size() / 2; ++k) {
    const auto keyframe = keyframer.add(drive.scan(k).scan);
    if (!keyframe) continue;
    mapper.add(*keyframe);
    const std::vector<model::MapLandmark> whole = mapper.landmarks();
    std::vector<model::MapLandmark> changed = mapper.take_changed_landmarks();
    mapper.set_covariances(changed);
    for (const model::MapLandmark& one : changed) {
      const auto same = std::ranges::find(whole, one.id, &model::MapLandmark::id);
      REQUIRE(same != whole.end());
      REQUIRE(one.covariance_m2.determinant() > 0.0);
      REQUIRE((one.covariance_m2 - same->covariance_m2).norm() <= 1e-9 * one.covariance_m2.norm());
    }
  }
}

TEST_CASE("Landmarks of a given map are told as they were given until they are observed",
          "[mapper][told]") {
  SmoothingMapperParameters parameters;
  parameters.scale_sigma = 0.1;
  SmoothingMapper mapper(parameters);
  std::vector<model::MapLandmark> given(3);
  for (std::size_t i = 0; i < given.size(); ++i) {
    given[i].position_m = {10.0 * static_cast<double>(i), 100.0};
    given[i].covariance_m2 << 0.04, 0.01, 0.01, 0.09;
  }
  mapper.start_with(given);
  const std::vector<model::MapLandmark> told = mapper.landmarks();
  REQUIRE(told.size() == given.size());
  for (std::size_t i = 0; i < given.size(); ++i)
    CHECK((told[i].covariance_m2 - given[i].covariance_m2).norm() < 1e-12);
}
