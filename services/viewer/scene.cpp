#include "services/viewer/scene.hpp"

#include <utility>

namespace understory::viewer {
namespace {

constexpr std::size_t kMostLogLines = 500;
/// 99.9 % of chi^2 with the 3 degrees of freedom of a pose: above it the covariance is reported as
/// too small, until NEES is below kNeesBound again.
constexpr double kTooSureNees = 16.3;

}  // namespace

void Scene::reset() {
  start_map(0);
  map_.want_whole();
  scan_.clear();
  changed(numbers_) = {};
  closures_.clear();
  processes_.clear();
  log_.clear();
  truth_.clear();
  ages_.clear();
  pose_.clear();
}

/// Another map has another frame: earlier positions are invalid in it.
void Scene::start_map(std::uint32_t map_id) {
  map_.start(map_id);
  pose_.start_map();
  truth_.start_map();
  closures_.clear();
  changed(matches_) = {};
  SceneNumbers& numbers = changed(numbers_);
  numbers.error_m = numbers.error_rad = numbers.nees = std::nullopt;
  numbers.is_too_sure = false;
  reset_change_ = ++change_;
}

void Scene::take(const model::SlamPose& pose, std::int64_t wall_us) {
  ages_.note(pose.utime, wall_us);
  if (has_place(pose) && pose.map_id != map_.id()) {
    if (map_.id() != 0) start_map(pose.map_id);
    map_.set_id(pose.map_id);
  }
  pose_.take(pose, wall_us);
  if (has_place(pose)) compare_with_truth(pose);
  pose_.judge(numbers_.value);

  // Rate and latency of poses.
  SceneNumbers& numbers = changed(numbers_);
  if (const auto rate_hz = pose_.rate_hz()) numbers.rate_hz = rate_hz;
  if (const auto age_ms = ages_.age_ms(pose.utime, wall_us)) numbers.latency_ms = age_ms;
}

void Scene::compare_with_truth(const model::SlamPose& pose) {
  const auto error = truth_.compare(pose);
  if (!error) return;
  SceneNumbers& numbers = changed(numbers_);
  numbers.error_m = error->error_m;
  numbers.error_rad = error->error_rad;
  if (error->nees) numbers.nees = error->nees;
  numbers.is_too_sure = error->is_tied && numbers.nees &&
                        *numbers.nees > (numbers.is_too_sure ? kNeesBound : kTooSureNees);
}

void Scene::look(std::int64_t wall_us) {
  processes_.look(wall_us);
  if (!pose_.falls_silent(wall_us, numbers_.value.rate_hz, ages_.utime())) return;
  if (numbers_.value.rate_hz) changed(numbers_).rate_hz.reset();
}

void Scene::take(const model::MapUpdate& update) {
  ages_.note(update.utime);
  const bool starts = update.status == model::MapUpdateStatus::kFirstMap;
  if (starts && map_.id() != 0) start_map(update.map_id);
  if (starts || map_.id() == 0) map_.set_id(update.map_id);
  if (starts) truth_.tie(update);
  changed(matches_).update = update;

  if (starts || update.status == model::MapUpdateStatus::kUpdated)
    map_.take(model::KeyframePose{update.keyframe_sequence, update.utime, update.map_T_vehicle,
                                  update.covariance});
  if (update.degrees_of_freedom > 0) {
    SceneNumbers& numbers = changed(numbers_);
    numbers.nis = update.chi2;
    numbers.nis_dof = update.degrees_of_freedom;
  }
}

void Scene::take(const model::WholeMap& map) {
  ages_.note(map.utime);
  map_.take(map);
}

void Scene::take(const model::MapDelta& delta) {
  ages_.note(delta.utime);
  if (map_.is_restarted_by(delta)) start_map(map_.id());
  map_.take(delta);
}

void Scene::take(const model::Existence& existence) {
  ages_.note(existence.utime);
  map_.take(existence);
  SceneNumbers& numbers = changed(numbers_);
  numbers.missing_share = existence.missing_share;
  numbers.new_share = existence.new_share;
  numbers.is_mapping_needed = existence.is_mapping_needed;
}

void Scene::take(const model::LandmarkScan& scan, std::int64_t wall_us) {
  ages_.note(scan.utime, wall_us);
  scan_.take(scan);
}

void Scene::take(const log_t& line) {
  if (log_.size() >= kMostLogLines) log_.pop_front();
  log_.push_back({line, ++change_});
}

}  // namespace understory::viewer
