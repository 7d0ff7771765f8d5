// What a submap's payload says of how it lies to others.
#include <map>
#include <string>
#include <string_view>

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

/// Version 3 of the payload as the code of then wrote it: node 7 with one landmark, seen from nodes
/// 7 and 8, one keyframe, a motion to node 8 and a closure with node 31.
constexpr std::string_view kVersion3 =
    "1f0000000000000067656f736c616d5f6d61707065722e736d6f6f7468696e672e7375626d61700300000007"
    "00000001000000000000000500000000000100000000000000f83f00000000000002c0000000000000000000"
    "00000000000000000000000000000000000000000000000000000000007940000000000000c03f090000000c"
    "0000000200000000000000070000000800000002000000000000000000284100004041000000010000000000"
    "0000020000000000000007000000000000000000f43f00000000000004c00000000000005040000000000000"
    "204000000000000020400000000000004040080000000000000000000cc0000000000000e83f000000000000"
    "3040000000000000000000000000000000000000000000003040010000000000000007000000290000000000"
    "0000404b4c0000000000000000000000e0bf000000000000d03f000000000000c03f000000000000503f0000"
    "00000000000000000000000000000000000000000000000000000000503f0000000000000000000000000000"
    "00000000000000000000000000000000503f000000000000b03f000000000000000000000000000000000000"
    "0100000000000000000000000000b03f00000000000000000000000000000000020000000000000007000000"
    "080000000000000000803340000000000000e03f000000000000d03f00000000000090400000000000003040"
    "0000000000000000000000000000304000000000000080400000000000001040000000000000000000000000"
    "00001040000000000000a040000000000000000000070000001f0000000000000000803340000000000000e0"
    "3f000000000000d03f0000000000009040000000000000304000000000000000000000000000003040000000"
    "0000008040000000000000104000000000000000000000000000001040000000000000a040004d0000000000"
    "0000";

std::string bytes_of(std::string_view hexadecimal) {
  std::string bytes;
  for (std::size_t i = 0; i + 1 < hexadecimal.size(); i += 2)
    bytes += static_cast<char>(std::stoi(std::string(hexadecimal.substr(i, 2)), nullptr, 16));
  return bytes;
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

TEST_CASE("A submap of before, without what stood for its landmarks, is read", "[geoslam_mapper]") {
  const std::string before = bytes_of(kVersion3);
  const SubmapContent content = submap_content(before);
  CHECK(content.node == 7);
  REQUIRE(content.landmarks.size() == 1);
  CHECK(content.landmarks[0].id == 0x1000000000005);
  CHECK(content.landmarks[0].position_m == Eigen::Vector2d(1.5, -2.25));
  CHECK(content.landmarks[0].nodes == std::vector<NodeIndex>{7, 8});
  CHECK(content.landmarks[0].views_m == std::vector<float>{10.5F, 12.0F});

  REQUIRE(content.observed.size() == 1);
  REQUIRE(content.observed[0].size() == 2);
  CHECK(content.observed[0][1].node == 8);
  CHECK(content.observed[0][1].position_m == Eigen::Vector2d(-3.5, 0.75));
  REQUIRE(content.bases.bases.size() == 1);
  CHECK(content.bases.bases[0].sequence == 41);
  CHECK(content.bases.centre_T_viewpoints.size() == 1);

  REQUIRE(content.motions.size() == 2);
  CHECK(content.motions[0].a == 7);
  CHECK(content.motions[0].b == 8);
  CHECK(content.motions[0].a_T_b.coordinates() == Eigen::Vector3d(19.5, 0.5, 0.25));
  CHECK(content.motions[0].information(0, 1) == 16.0);
  CHECK(content.motions[0].away == 0);
  CHECK(content.motions[0].closure == 0);
  CHECK(content.motions[1].b == 31);
  CHECK(content.motions[1].closure == 77);
  CHECK(content.ties.empty());

  for (std::size_t size = 0; size < before.size(); size += 7)
    CHECK_THROWS_AS(submap_content(before.substr(0, size)), std::invalid_argument);
}
