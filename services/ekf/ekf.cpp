#include "services/ekf/ekf.hpp"

#include <algorithm>

#include "common/state/archive.hpp"

namespace understory::ekf {
namespace {

constexpr state::Format kStageFormat{"ekf_stage", 1};

}  // namespace

EkfOutput Ekf::add(const model::Odometry& increment) {
  const std::uint64_t jumps = filter_.counters().clock_jumps;
  filter_.add(increment);
  if (filter_.counters().clock_jumps != jumps) begin_anew();
  if (ahead_) ahead_->add(increment);

  // Is a scan overdue?
  if (!ahead_ && filter_.has_overdue()) ahead_ = filter_;
  if (!ahead_ || !ahead_->has_overdue()) return {};
  EkfOutput output = ahead_->go_ahead();
  given_ = output.pose->utime;

  // Waits no longer than the limit.
  if (filter_.waiting_s() > kOldestScan_s) {
    filter_ = *ahead_;
    ahead_.reset();
  }
  return output;
}

void Ekf::add(const model::RawPose& pose) {
  filter_.add(pose);
  if (ahead_) ahead_->add(pose);
}

EkfOutput Ekf::add(const model::TrackedScan& scan) {
  if (!filter_.takes_scan_at(scan.utime)) return filter_.add(scan);
  const std::uint64_t jumps = filter_.counters().clock_jumps;
  drop_copy();
  EkfOutput output = filter_.add(scan);
  if (filter_.counters().clock_jumps != jumps) given_ = 0;
  if (!output.pose) return output;
  output.is_late = output.pose->utime <= given_;
  given_ = std::max(given_, output.pose->utime);
  return output;
}

/// If the copy had restarted, its poses are followed by a jump back.
void Ekf::drop_copy() {
  if (!ahead_) return;
  const std::uint64_t given = ahead_->counters().restarts;
  const bool has_restarted = given > filter_.counters().restarts;
  while (has_restarted && filter_.counters().restarts <= given)
    filter_.count_restart("odometry without scans had gone ahead over a gap");
  ahead_.reset();
}

void Ekf::begin_anew() {
  drop_copy();
  given_ = 0;
}

EkfCounters Ekf::counters() const {
  EkfCounters counters = filter_.counters();
  if (!ahead_ || ahead_->counters().restarts <= counters.restarts) return counters;
  counters.restarts = ahead_->counters().restarts;
  counters.last_reason = ahead_->counters().last_reason;
  return counters;
}

/// The copy can be rebuilt from the filter and its waiting odometry.
std::string Ekf::save() const {
  return state::save(kStageFormat, filter_.save(), given_, ahead_.has_value());
}

void Ekf::load(const std::string& state) {
  std::string filter;
  model::Utime given = 0;
  bool is_ahead = false;
  state::load(state, kStageFormat, filter, given, is_ahead);
  filter_.load(filter);
  given_ = given;
  ahead_.reset();
  if (!is_ahead) return;
  ahead_ = filter_;
  if (ahead_->has_overdue()) ahead_->go_ahead();
}

}  // namespace understory::ekf
