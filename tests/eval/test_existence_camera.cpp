// The camera that comes back to an old map: mapping by stereo, association by projection, rows by
// hand, one small case as a whole.
#include <algorithm>
#include <cmath>

#include "eval/experiments/existence/camera/camera_rows.hpp"
#include "eval/experiments/existence/camera/projection.hpp"
#include "eval/experiments/existence/camera/tracker.hpp"
#include "eval/experiments/existence/own_methods.hpp"
#include "eval/experiments/existence/references.hpp"
#include "sim/changes/changed_drive.hpp"
#include "tests/catch.hpp"

using namespace understory;
using namespace understory::eval::experiments::existence;
using namespace understory::eval::experiments::existence::camera;
using understory::existence::Ray;

namespace {

CaseSetting small_office(double changed) {
  CaseSetting setting;
  setting.changed = changed;
  setting.changed_drives = 3;
  setting.frames_per_s = 2.0;
  setting.frames_per_query = 8;
  return setting;
}

/// A point 4 m ahead of a camera at the origin, mapped from there.
CameraPoint point_ahead() {
  CameraPoint point;
  point.position_m = {0.0, 0.0, 4.0};
  point.seen_from = {0.0, 0.0, -1.0};
  point.nearest_m = point.farthest_m = 4.0;
  return point;
}

const std::vector<CameraMethod> kThree{
    {{"no removal", make_no_removal, {}}, false},
    {{"icosahedral", make_icosahedral, {0.25, 20.0, 0.95, 200.0}}, false},
    {{"ideal", make_ideal, {}}, false}};

}  // namespace

TEST_CASE("a point is expected where it was mapped from, and found by its descriptor",
          "[existence]") {
  const sim::changes::CameraParameters camera;
  const std::vector<CameraPoint> map{point_ahead()};
  auto expected = points_in_view(map, Eigen::Isometry3d::Identity(), camera);
  REQUIRE(expected.size() == 1);
  CHECK(expected[0].disparity_px == Approx(camera.focal_px * camera.baseline_m / 4.0));
  // From twice as far it was never seen, nor from behind.
  CHECK(
      points_in_view(map, Eigen::Isometry3d(Eigen::Translation3d(0.0, 0.0, -4.0)), camera).empty());
  Eigen::Isometry3d behind(Eigen::Translation3d(0.0, 0.0, 8.0));
  behind.rotate(Eigen::AngleAxisd(3.14159265, Eigen::Vector3d::UnitY()));
  CHECK(points_in_view(map, behind, camera).empty());

  sim::changes::Keypoint near_by, other_texture;
  near_by.pixel = expected[0].pixel + Eigen::Vector2d(3.0, 0.0);
  near_by.disparity_px = other_texture.disparity_px = expected[0].disparity_px;
  other_texture.pixel = expected[0].pixel;
  other_texture.descriptor = {~0ULL, ~0ULL, 0, 0};
  associate(expected, map, std::vector{other_texture, near_by}, {});
  CHECK(expected[0].keypoint == 1);
  associate(expected, map, std::vector{other_texture}, {});
  CHECK(expected[0].keypoint == kNoKeypoint);
}

TEST_CASE("what is beside its place is another thing, as far as the pose can tell", "[existence]") {
  const sim::changes::CameraParameters camera;
  const std::vector<CameraPoint> map{point_ahead()};
  const auto found_beside = [&](double aside_px, double turn_sigma_rad) {
    auto expected = points_in_view(map, Eigen::Isometry3d::Identity(), camera);
    sim::changes::Keypoint keypoint;
    keypoint.pixel = expected[0].pixel + Eigen::Vector2d(aside_px, 0.0);
    keypoint.disparity_px = expected[0].disparity_px;
    PoseGate gate;
    gate.covariance.diagonal().head<3>().setConstant(turn_sigma_rad * turn_sigma_rad);
    associate_within(expected, map, std::vector{keypoint}, camera, gate);
    return expected.empty() ? -1 : expected[0].keypoint == 0 ? 1 : 0;
  };
  // A thing moved by 4 cm across, 4 m ahead.
  CHECK(found_beside(1.0, 0.0) == 1);
  CHECK(found_beside(4.0, 0.0) == 0);
  CHECK(found_beside(4.0, 0.005) == 1);
  // The pose leaves the point open by 50 px: no look.
  CHECK(found_beside(4.0, 0.05) == -1);
}

TEST_CASE("a tracker does not follow what was moved, and what was moved leaves use",
          "[existence]") {
  CaseSetting setting;
  setting.has_bare_walls = true;
  setting.changed = 0.5;
  const CaseResult result = run_case(setting, 51, kThree, 1);
  const MethodOnCase& ours = result.methods[1];
  const MethodOnCase& ideal = result.methods[2];
  const auto found = [](const MethodOnCase& method) {
    return std::count_if(method.queries.begin(), method.queries.end(),
                         [](const Query& query) { return query.is_success; });
  };
  CHECK(found(ours) >= found(ideal));
  CHECK(std::none_of(ours.queries.begin(), ours.queries.end(),
                     [](const Query& query) { return query.is_wrong; }));
  // A table with 44 of 758 points was moved by half a metre.
  CHECK(result.methods[0].ate_m < 0.03);
  CHECK(brier_score(ours.scored) < 0.02);
}

TEST_CASE("a disparity beside the line of sight tells hidden from gone", "[existence]") {
  const sim::changes::CameraParameters camera;
  const std::vector<CameraPoint> map{point_ahead()};
  const auto expected = points_in_view(map, Eigen::Isometry3d::Identity(), camera);
  const auto ray = [&](double depth_m, double aside_px) {
    sim::changes::Keypoint keypoint;
    keypoint.pixel = expected[0].pixel + Eigen::Vector2d(aside_px, 0.0);
    keypoint.disparity_px = camera.focal_px * camera.baseline_m / depth_m;
    return ray_beside(expected[0], std::vector{keypoint}, camera);
  };
  CHECK(ray(2.0, 5.0) == Ray::kBlocked);
  CHECK(ray(7.0, 5.0) == Ray::kPassed);
  CHECK(ray(4.1, 5.0) == Ray::kUnknown);
  CHECK(ray(2.0, 15.0) == Ray::kBlocked);
  CHECK(ray(7.0, 15.0) == Ray::kUnknown);
  CHECK(ray(2.0, 40.0) == Ray::kUnknown);
}

TEST_CASE("a camera's map has its points where they are, and each once", "[existence]") {
  CaseSetting setting = small_office(0.0);
  setting.changed_drives = 1;
  const CameraCase one = make_case(setting, 5, false);
  const sim::changes::Replay replay(sim::changes::make_course(setting.scene, {}, 5), {});
  REQUIRE(one.map.size() > 500);

  std::size_t near = 0;
  std::vector<sim::changes::PointId> ids;
  for (const CameraPoint& point : one.map) {
    const auto& points = replay.unchanged().points;
    const auto truth = std::find_if(points.begin(), points.end(), [&point](const auto& surface) {
      return surface.id == point.truth;
    });
    if (truth == points.end()) continue;
    ids.push_back(point.truth);
    near += (truth->position_m - point.position_m).norm() < 0.1 * point.nearest_m ? 1 : 0;
  }

  CHECK(static_cast<double>(near) > 0.97 * static_cast<double>(one.map.size()));
  std::sort(ids.begin(), ids.end());
  const auto last = std::unique(ids.begin(), ids.end());
  CHECK(static_cast<double>(ids.end() - last) < 0.06 * static_cast<double>(ids.size()));

  // What is there is seen again on the next drive; what was seen less than five times is no point.
  CHECK(one.keypoints.back().without_point < one.keypoints.back().all / 2);
}

TEST_CASE("a changed office: what is gone is removed, and the camera is found", "[existence]") {
  const CaseResult result = run_case(small_office(0.5), 6, kThree, 1);
  const MethodOnCase& none = result.methods[0];
  const MethodOnCase& ours = result.methods[1];
  const MethodOnCase& ideal = result.methods[2];
  CHECK(none.map_points == result.map_points);
  CHECK(ideal.map_points < result.map_points);
  CHECK(ours.map_points < result.map_points);
  REQUIRE(ours.scored.size() > 100);
  CHECK(roc_area(ours.scored) > 0.95);
  CHECK(roc_area(ideal.scored) == 1.0);
  REQUIRE(ours.queries.size() == none.queries.size());
  CHECK(std::isfinite(ours.ate_m));
  CHECK(ours.ate_m < 0.1);
  REQUIRE(result.signals.size() == 3);

  const CaseResult again = run_case(small_office(0.5), 6, kThree, 1);
  CHECK(again.methods[1].map_points == ours.map_points);
  CHECK(again.methods[1].ate_m == ours.ate_m);

  // An unchanged world asks less for mapping, and loses nothing.
  const CaseResult same = run_case(small_office(0.0), 6, kThree, 1);
  CHECK(same.signals.front().both() < 0.5 * result.signals.front().both());
  CHECK(removed_share(same.methods[1].scored, true) < 0.01);
  const nlohmann::json rows = mapping_needed_rows({result, same});
  CHECK(rows.front()["auc"] == 1.0);
}

TEST_CASE("intervals and rows by hand", "[existence]") {
  CHECK(wilson_pct(0, 0).high == 100.0);
  CHECK(wilson_pct(5, 10).low == Approx(23.66).margin(0.01));
  CHECK(wilson_pct(10, 10).high == Approx(100.0));

  CaseResult run;
  run.map_points = 4;
  run.tracked_frames = 2;
  run.methods.resize(3);
  for (MethodOnCase& method : run.methods) {
    method.scored = {{0.1, false}, {0.9, true}, {0.1, true}};
    method.queries = {{true, false, 10, 0.02}, {false, true, 30, 0.0}};
  }
  run.methods[1].queries[1] = {true, false, 20, 0.04};
  const nlohmann::json rows = culling_rows({&run}, kThree);
  CHECK(rows[0]["success_pct"] == 50.0);
  CHECK(rows[0]["wrong_accepted"] == 1);
  CHECK(rows[0]["samples_mean"] == 20.0);
  CHECK(rows[1]["success_pct"] == 100.0);
  CHECK(rows[1]["gained_frames"] == 1);
  CHECK(rows[1]["gone_removed_pct"] == 100.0);
  CHECK(rows[1]["wrongly_removed_pct"] == 50.0);
}
