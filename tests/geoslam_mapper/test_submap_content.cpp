// What a submap's payload says of how it lies to others.
#include <map>

#include "common/geometry/decompositions.hpp"
#include "common/state/archive.hpp"
#include "services/geoslam_mapper/smoothing/smoothing_mapper.hpp"
#include "services/geoslam_mapper/smoothing/submap_content.hpp"
#include "tests/catch.hpp"
#include "tests/loop_closer/ring_drive.hpp"

using namespace understory;
using namespace understory::geoslam_mapper;
using namespace understory::geoslam_mapper::smoothing;

namespace {

std::vector<model::Submap> handed_over() {
  test::RingOptions options;
  options.seed = 61;
  options.radius_m = 150.0;
  options.laps = 0.6;
  options.blind_from = 2.0;
  const test::RingDrive drive(options);
  SmoothingMapperParameters parameters;
  parameters.use_odometry = true;
  parameters.condense_m = 10.0;
  parameters.hand_over_m = 60.0;
  SmoothingMapper mapper(parameters);
  std::vector<model::Submap> submaps;
  for (std::size_t k = 0; k < drive.size(); ++k) {
    if (k > 0) mapper.add(drive.odometry_to(k));
    mapper.add(drive.keyframe_at(k));
    for (model::Submap& one : mapper.take_given_away()) submaps.push_back(std::move(one));
  }
  return submaps;
}

}  // namespace

TEST_CASE("A submap that is handed over says how it lies to its neighbours", "[geoslam_mapper]") {
  const std::vector<model::Submap> submaps = handed_over();
  REQUIRE(submaps.size() > 10);
  std::map<NodeIndex, geometry::SE2> pose_of;
  for (const model::Submap& one : submaps)
    pose_of[submap_content(one.payload).node] = one.map_T_submap;

  std::size_t between = 0;
  for (const model::Submap& one : submaps) {
    const SubmapContent content = submap_content(one.payload);
    CHECK_FALSE(content.motions.empty());
    CHECK(submap_payload(content) == one.payload);
    for (const FrozenMotion& motion : content.motions) {
      CHECK((motion.a == content.node || motion.b == content.node));
      CHECK(geometry::eigenvalues(motion.information)[0] > 0.0);
      if (!pose_of.contains(motion.a) || !pose_of.contains(motion.b)) continue;
      ++between;
      const geometry::SE2 lies = pose_of.at(motion.a).inverse() * pose_of.at(motion.b);
      CHECK((motion.a_T_b.inverse() * lies).Log().norm() < 0.3);
    }
  }
  CHECK(between > submaps.size());
}

TEST_CASE("A submap of before, without motions, is read", "[geoslam_mapper]") {
  SubmapContent content = submap_content(handed_over().front().payload);
  const std::string before = state::save({"geoslam_mapper.smoothing.submap", 2}, content.node,
                                         content.landmarks, content.observed, content.bases);
  content.motions.clear();
  content.ties.clear();
  CHECK(submap_payload(submap_content(before)) == submap_payload(content));
  CHECK_THROWS_AS(submap_content("nothing of ours"), std::invalid_argument);
  CHECK_THROWS_AS(submap_content(before.substr(0, before.size() / 2)), std::invalid_argument);
}
