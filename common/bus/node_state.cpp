// State over restarts: the node's part (time, sequence numbers) and the stage's part.
#include "common/bus/node_state.hpp"

#include <stdexcept>

#include "common/bus/node.hpp"

namespace understory::bus {

void Node::keep_state(std::function<std::string()> save,
                      std::function<void(const std::string&)> load,
                      std::function<void(std::int64_t)> lost) {
  stage_ = {std::move(save), std::move(load), std::move(lost)};
}

void Node::tell_of_loss(const StateStore& store) {
  const std::optional<std::int64_t> written_s = store.lost_snapshot_s();
  if (!written_s || !stage_.lost) return;
  stage_.lost(*written_s);
  log(Level::kWarning, to_string(wire::Reason::kSnapshotDamaged),
      "an earlier state is lost: nothing of it is gone on with");
}

std::string Node::save_state() const {
  NodeState state;
  state.now_us = time_.now();
  for (const auto& input : inputs_) {
    state.inputs[input->channel] = {input->sequence.newest_sequence(),
                                    input->sequence.newest_utime()};
    state.paces[input->channel] = {input->pace.newest_us, input->pace.interval_us};
  }
  for (const Output& output : outputs_) state.outputs[output.channel] = output.next_sequence;
  state.timers_due_us = timers_.due_us();
  if (stage_.save) state.stage = stage_.save();
  return state::save(NodeState::kFormat, state);
}

void Node::load_state(const std::string& bytes) {
  NodeState state;
  state::load(bytes, NodeState::kFormat, state);
  if (state.timers_due_us.size() != timers_.due_us().size()) {
    throw std::runtime_error("the state is of another version of this service");
  }

  time_.resume(state.now_us);
  for (const auto& input : inputs_) {
    const auto found = state.inputs.find(input->channel);
    if (found == state.inputs.end()) continue;
    input->sequence.resume(found->second.first, found->second.second);
    const auto pace = state.paces.find(input->channel);
    if (pace != state.paces.end()) input->pace = {pace->second.first, pace->second.second};
  }
  for (Output& output : outputs_) {
    const auto found = state.outputs.find(output.channel);
    if (found != state.outputs.end()) output.next_sequence = found->second;
  }
  timers_.resume(state.timers_due_us);
  state_.resume(state.now_us);

  if (stage_.load) stage_.load(state.stage);
}

bool Node::recover(StateStore& store) {
  // Load the snapshot and repeat the later inputs.
  StateStore::Recovered recovered = store.open();
  bool is_loaded = true;
  source_ = Source::kJournal;
  announcer_.mute(true);
  try {
    if (recovered.snapshot) {
      load_state(*recovered.snapshot);
    } else {
      tell_of_loss(store);
    }
    for (const JournalEvent& event : recovered.events) feed({event.channel, event.bytes, 0});
  } catch (const std::exception& error) {
    recovered.problems.push_back({wire::Reason::kSnapshotDamaged, error.what()});
    is_loaded = false;
  }
  source_ = Source::kBus;
  announcer_.mute(false);
  store.end_recovery();

  // Report lost and loaded parts.
  if (store.needs_snapshot()) state_.start_failed();
  for (const wire::Refusal& problem : recovered.problems) {
    problem.reason == wire::Reason::kStateNotKept ? show_kept(problem)
                                                  : report(problem.reason, problem.detail);
  }
  if (is_loaded && (recovered.snapshot || !recovered.events.empty())) {
    log(Level::kInfo, "recovered",
        "state of utime " + std::to_string(state_.saved_utime()) + " and " +
            std::to_string(recovered.events.size()) + " events since");
  }
  state_.set_events(static_cast<int>(recovered.events.size()));
  return is_loaded;
}

void Node::save_snapshot() {
  show_kept(state_.save(now(), [this] { return save_state(); }));
}

/// A failure to save is a condition of the process until a snapshot is saved.
void Node::show_kept(const std::optional<wire::Refusal>& refusal) {
  constexpr wire::Reason kReason = wire::Reason::kStateNotKept;
  const bool holds = state_.is_failing();
  const bool has_changed = monitor_.set_condition(
      "", kReason, holds, refusal ? refusal->detail : "the state directory cannot be written");

  // The begin of a condition is counted by set_condition().
  if (refusal && holds && has_changed) {
    announcer_.report(now(), kReason, refusal->detail, {});
  } else if (refusal) {
    report(refusal->reason, refusal->detail);
  } else if (has_changed) {
    log(Level::kInfo, to_string(kReason), "the state is kept again");
  }
}

}  // namespace understory::bus
