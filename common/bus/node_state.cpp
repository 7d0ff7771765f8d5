// State over restarts: the node's own part (time, sequence numbers) and the stage's.
#include <algorithm>
#include <sstream>
#include <stdexcept>

#include "common/bus/node.hpp"

namespace understory::bus {

void Node::keep_state(std::function<std::string()> save,
                      std::function<void(const std::string&)> load) {
  save_ = std::move(save);
  load_ = std::move(load);
}

std::string Node::save_state() const {
  std::ostringstream out;
  out << "node 1 " << clock_.now() << ' ' << inputs_.size() << ' ' << outputs_.size() << ' '
      << timers_.size() << '\n';
  for (const auto& input : inputs_) {
    out << input->channel << ' ' << input->sequence.newest_sequence() << ' '
        << input->sequence.newest_utime() << '\n';
  }
  for (const Output& output : outputs_)
    out << output.channel << ' ' << output.next_sequence << '\n';
  for (const Timer& timer : timers_) out << timer.due << '\n';
  out << "stage\n" << (save_ ? save_() : std::string());
  return out.str();
}

void Node::load_state(const std::string& state) {
  std::istringstream in(state);
  std::string word;
  int version = 0;
  model::Utime now = -1;
  std::size_t inputs = 0;
  std::size_t outputs = 0;
  std::size_t timers = 0;
  in >> word >> version >> now >> inputs >> outputs >> timers;
  if (!in || word != "node" || version != 1 || timers != timers_.size()) {
    throw std::runtime_error("the state is of another version of this service");
  }
  clock_.resume(now);
  for (std::size_t i = 0; i < inputs; ++i) {
    std::int64_t sequence = 0;
    std::int64_t utime = 0;
    in >> word >> sequence >> utime;
    for (const auto& input : inputs_) {
      if (input->channel == word) input->sequence.resume(sequence, utime);
    }
  }
  for (std::size_t i = 0; i < outputs; ++i) {
    std::int64_t next = 0;
    in >> word >> next;
    for (Output& output : outputs_) {
      if (output.channel == word) output.next_sequence = next;
    }
  }
  for (Timer& timer : timers_) in >> timer.due;
  in >> word;
  if (!in || word != "stage" || in.get() != '\n')
    throw std::runtime_error("the state is not whole");
  snapshot_utime_ = snapshot_base_ = now;
  if (load_) load_(state.substr(static_cast<std::size_t>(in.tellg())));
}

bool Node::recover(StateStore& store) {
  StateStore::Recovered recovered = store.open();
  bool is_loaded = true;
  is_recovering_ = true;
  try {
    if (recovered.snapshot) load_state(*recovered.snapshot);
    for (const JournalEvent& event : recovered.events) feed({event.channel, event.bytes, 0});
  } catch (const std::exception& error) {
    recovered.problems.push_back({wire::Reason::kSnapshotDamaged, error.what()});
    is_loaded = false;
  }
  is_recovering_ = false;
  store.end_recovery();
  for (const wire::Refusal& problem : recovered.problems) report(problem.reason, problem.detail);
  if (is_loaded && (recovered.snapshot || !recovered.events.empty())) {
    log(Level::kInfo, "recovered",
        "state of utime " + std::to_string(snapshot_utime_) + " and " +
            std::to_string(recovered.events.size()) + " events since");
  }
  events_since_snapshot_ = static_cast<int>(recovered.events.size());
  return is_loaded;
}

void Node::save_snapshot() {
  if (store_ == nullptr || now() < 0) return;
  snapshot_tried_ = now();
  try {
    if (const auto refusal = store_->save(save_state())) {
      return report(refusal->reason, refusal->detail);
    }
  } catch (const std::exception& error) {
    return report(wire::Reason::kStateNotKept, error.what());
  }
  snapshot_utime_ = snapshot_base_ = now();
  events_since_snapshot_ = 0;
}

void Node::snapshot_when_due() {
  if (store_ == nullptr || events_since_snapshot_ == 0) return;
  if (snapshot_base_ < 0 || snapshot_base_ > now()) snapshot_base_ = now();
  // After a failure (a full disk, say) it is tried again once a second, not at every event.
  constexpr model::Utime kRetryUs = 1000000;
  const bool has_waited = snapshot_tried_ < 0 || now() - snapshot_tried_ >= kRetryUs;
  const bool is_due = events_since_snapshot_ >= options_.snapshot_every_events ||
                      now() - snapshot_base_ >= options_.snapshot_every_us ||
                      store_->needs_snapshot();
  if (is_due && has_waited) save_snapshot();
}

}  // namespace understory::bus
