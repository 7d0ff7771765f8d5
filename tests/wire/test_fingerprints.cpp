// The fingerprint of every wire type. A change here makes recorded logs unreadable: give the new
// version a new name instead, and pin that too.
#include <cstdint>
#include <string>

#include "common/wire/layout.hpp"
#include "tests/catch.hpp"

namespace {

struct Pin {
  const char* type;
  std::uint64_t fingerprint;
};

constexpr Pin kPins[] = {
    {"association_t", 0x4f1fb864e9129458ULL},
    {"channel_health_t", 0x3b1e2e0a8ed6bf50ULL},
    {"config_t", 0xd7cb12688925d455ULL},
    {"detection_t", 0x977e0277761b6355ULL},
    {"ekf_landmark_t", 0x7f92258080217ee1ULL},
    {"ekf_level_t", 0xf2a1444334275349ULL},
    {"ekf_map_t", 0x908130a9cc22dfadULL},
    {"ekf_pose_t", 0x6b017bfb16cf0817ULL},
    {"existence_state_t", 0xc0fee520adb31792ULL},
    {"existence_t", 0x1aa56d94d6d12366ULL},
    {"expected_landmark_t", 0x2df12eb9df769deeULL},
    {"gnss_t", 0xd96d0af0ca3d759aULL},
    {"ground_truth_t", 0x81e9a5473725f184ULL},
    {"health_t", 0xb8f9eafd7c1dc8b5ULL},
    {"identified_detection_t", 0xbfe84f7960c59f5eULL},
    {"imu_t", 0x5b7491d9119496ddULL},
    {"keyframe2_t", 0xcebaa512309b8c40ULL},
    {"keyframe_detection_t", 0x546f542f8a8f7cffULL},
    {"keyframe_landmark_t", 0x84f56a9d3a79d47dULL},
    {"keyframe_member_t", 0xaf8e0b7b9db1894bULL},
    {"keyframe_pose_t", 0xa5fa9d53288f243fULL},
    {"keyframe_t", 0x56ea011c243abf63ULL},
    {"landmark_existence_t", 0x9b73240d1919bd38ULL},
    {"landmarks_t", 0x85e7b855331a67daULL},
    {"level_error_t", 0x22d98f2cbc23e7c8ULL},
    {"lidar_scan_t", 0x2f0525fc9599a15bULL},
    {"lidar_sweep_t", 0xc6e641bff98690ebULL},
    {"log_t", 0xca8d03aba370c85aULL},
    {"loop_closure2_t", 0x860481c6350d5f67ULL},
    {"loop_closure_t", 0x9b2815d3e69be4dfULL},
    {"loop_end_t", 0x0293fc57645ad425ULL},
    {"loop_result_t", 0x1f008682c3a71430ULL},
    {"map_correction_t", 0x612d42e03b4fbc59ULL},
    {"map_delta_t", 0x7d698f741ca18eb2ULL},
    {"map_landmark_t", 0x8af5ad310d5fd80eULL},
    {"map_request_t", 0x0a15ba7836cb1eb9ULL},
    {"map_t", 0x5717412839733911ULL},
    {"merge_t", 0x3afd1fb9bfcec6a7ULL},
    {"odometry2_t", 0xe17862c94d618facULL},
    {"odometry_t", 0x716f3ff5b4edace1ULL},
    {"place_scan_t", 0xe90e77fdfad45617ULL},
    {"pose2_t", 0xe923820e98208b26ULL},
    {"preintegration_t", 0x42556a8e73dd5d85ULL},
    {"raw_pose_t", 0xd5233c5fd8e067d8ULL},
    {"reason_count_t", 0xcc9becbf2c78c790ULL},
    {"rest_level2_t", 0xf50a17aece4e5c21ULL},
    {"rest_level_t", 0x2151626e736bc1d1ULL},
    {"scan_reference_t", 0xc77a89b2014c5ba6ULL},
    {"slam_pose2_t", 0xa9cc46a8f28379a8ULL},
    {"slam_pose_t", 0x0d82fef5d885f004ULL},
    {"slam_update2_t", 0x963157b97a369989ULL},
    {"slam_update3_t", 0x18e29fb29477a936ULL},
    {"slam_update_t", 0xef389e966858b506ULL},
    {"submap_pose_t", 0xeef2ae8092a154d8ULL},
    {"submap_query_t", 0xb22a151df660a77eULL},
    {"submap_stored_t", 0x5fc7775cedbd439aULL},
    {"submap_t", 0xa501f819d2552f7dULL},
    {"tracked_landmark_t", 0xf76ad6d1ed147913ULL},
    {"tracked_landmarks_t", 0xb9047692a48930a5ULL},
    {"truth_landmark_t", 0x72d0574c8bff17aeULL},
    {"truth_landmarks_t", 0x76fd9441e3de1147ULL},
    {"velocity_correction_t", 0x9c8e5db4bd067455ULL},
    {"view_ranges_t", 0x44e7264eaf281411ULL},
    {"wheels_t", 0xa9d9fa96c53d6adfULL},
};

}  // namespace

TEST_CASE("no wire type has changed") {
  for (const Pin& pin : kPins) {
    INFO(pin.type);
    const understory::wire::WireType* type =
        understory::wire::find_wire_type(std::string_view(pin.type));
    REQUIRE(type != nullptr);
    CHECK(static_cast<std::uint64_t>(type->fingerprint()) == pin.fingerprint);
  }
}

TEST_CASE("every wire type is pinned") {
  CHECK(understory::wire::wire_types().size() == std::size(kPins));
}
