#include "common/bus/node.hpp"

#include <algorithm>
#include <stdexcept>

namespace understory::bus {
namespace {

constexpr int kRefusedWindow = 32;  ///< Refused ones are counted among this many messages.
constexpr std::int64_t kSilent_us = 2'000'000;

}  // namespace

Node::Node(Bus& bus, NodeOptions options, Clock clock)
    : bus_(bus),
      options_(std::move(options)),
      computer_clock_(std::move(clock)),
      time_(options_.largest_clock_jump_us),
      monitor_(options_.process, options_.version, computer_clock_),
      announcer_(bus, options_.process, options_.version),
      state_(options_.snapshot_every_us, options_.snapshot_every_events) {}

void Node::add_input(const std::string& channel, Take take, SubscribeOptions options) {
  const auto& suffixed = options_.suffixed_inputs;
  const bool has_suffix = std::find(suffixed.begin(), suffixed.end(), channel) != suffixed.end();
  auto input = std::make_unique<Input>();
  input->name = channel;
  input->channel = channel + (has_suffix ? options_.channel_suffix : "");
  input->options = options;
  input->take = std::move(take);
  if (takes(input->channel)) throw std::logic_error(channel + " is subscribed twice");
  input->health = monitor_.add_channel(input->channel, false);
  input->refused = {wire::Reason::kInputRefused, "much of what comes is refused", input->channel,
                    Condition({kRefusedWindow, options_.refused_of_last_32})};
  inputs_.push_back(std::move(input));
}

std::size_t Node::add_output(const std::string& channel) {
  const std::string name = channel + options_.channel_suffix;
  if (const auto refusal = check_publishable(name, 0)) throw std::logic_error(refusal->detail);
  outputs_.push_back({channel, name, 0, monitor_.add_channel(name, true)});
  return outputs_.size() - 1;
}

void Node::connect() {
  connected_us_ = computer_clock_.monotonic_us();
  for (const auto& input : inputs_) {
    bus_.subscribe(input->channel, input->options.queue_size,
                   [this, raw = input.get()](const BusMessage& message) { handle(*raw, message); });
  }
  monitor_.ready();
}

bool Node::feed(const BusMessage& message) {
  for (const auto& input : inputs_) {
    if (input->channel != message.channel) continue;
    handle(*input, message);
    return true;
  }
  return false;
}

std::optional<wire::Refusal> Node::take(Input& input, const BusMessage& message) {
  if (message.bytes.size() > input.options.most_bytes) {
    return wire::Refusal{wire::Reason::kTooLarge, std::to_string(message.bytes.size()) +
                                                      " bytes; the configuration allows " +
                                                      std::to_string(input.options.most_bytes)};
  }
  return input.take(message.bytes, [&] { return admit(input, message); });
}

void Node::handle(Input& input, const BusMessage& message) {
  input.heard_us = computer_clock_.monotonic_us();
  input.is_late = false;
  bool is_refused = false;
  try {
    if (const auto refusal = take(input, message)) {
      report(refusal->reason, refusal->detail, input.channel);
      is_refused = true;
    }
  } catch (const std::exception& error) {
    report(wire::Reason::kStageFailed, error.what(), input.channel);
  }
  input.refused.condition.add(is_refused || input.is_late);
  show(input.refused);

  if (message.received_us != 0) {
    monitor_.count_latency(computer_clock_.wall_us() - message.received_us);
  }
  if (is_recovering()) return;
  if (const auto kept = state_.settle()) show_kept(*kept);
  if (state_.is_due(now())) save_snapshot();
}

bool Node::admit(Input& input, const BusMessage& message) {
  const wire::MessageHeader header = *wire::header_of(message.bytes);
  if (input.options.sequenced) {
    if (input.options.timed && !admit_time(input, message, header.utime)) return false;
    if (!admit_sequence(input, header)) return false;
    timers_.fire(time_.now());
    if (input.options.timed) input.pace.take(header.utime);
  }

  monitor_.count_message(input.health, header.utime);
  if (!is_recovering() && input.options.journaled) {
    show_kept(state_.append(input.channel, message.bytes));
  }
  return true;
}

bool Node::admit_sequence(Input& input, const wire::MessageHeader& header) {
  const Arrival arrival = input.sequence.take(header.sequence, header.utime);
  monitor_.set_sequence(input.health, input.sequence.counts());
  if (arrival != Arrival::kDuplicate && arrival != Arrival::kLate) return true;

  const bool is_late = arrival == Arrival::kLate;
  if (is_late && input.options.takes_late) return true;
  input.is_late = is_late;
  report(is_late ? wire::Reason::kLate : wire::Reason::kDuplicate,
         "seq " + std::to_string(header.sequence), input.channel);
  return false;
}

bool Node::admit_time(Input& input, const BusMessage& message, model::Utime utime) {
  using Verdict = MessageClock::Verdict;
  const Verdict verdict = time_.take(message, utime, input.pace);
  for (const HeldMessage& wrong : time_.wrong()) {
    report(wire::Reason::kClockJump,
           "utime " + std::to_string(wrong.utime) + " while it is " + std::to_string(now()),
           wrong.channel);
    count_wrong(wrong.channel);
  }
  if (verdict == Verdict::kFine) return true;
  if (source_ != Source::kBus) {
    // Proven and journaled messages were believed before: time jumps with them.
    start_at_jump(utime);
    return true;
  }
  if (verdict == Verdict::kJumped) feed_proven();
  return false;
}

/// Handles the waiting messages and the one that proved them, in the order of the journal.
void Node::feed_proven() {
  const std::vector<HeldMessage> proven = time_.jumped();
  log(Level::kWarning, to_string(wire::Reason::kClockJump),
      "time goes on at " + std::to_string(proven.front().utime), proven.front().channel);
  start_at_jump(proven.front().utime);
  source_ = Source::kProven;
  for (const HeldMessage& one : proven) feed(one.view());
  source_ = Source::kBus;
}

void Node::count_wrong(std::string_view channel) {
  for (const auto& input : inputs_) {
    if (input->channel == channel) input->refused.condition.add(true);
  }
}

void Node::start_at_jump(model::Utime utime) {
  time_.jumped();  // None waits any more.
  time_.resume(utime);
  // Sequence numbers from before the jump do not apply to later messages.
  for (const auto& one : inputs_) one->sequence.resume(-1, -1);
  timers_.start_over();
}

void Node::send(Output& output, model::Utime utime, const wire::Bytes& bytes,
                const wire::WireType& type) {
  if (is_recovering()) return;

  // The same checks as for inputs: values that are not finite are never published.
  std::optional<wire::Refusal> refusal = check_bytes(bytes, type);
  if (refusal) refusal = wire::Refusal{wire::Reason::kNotSent, refusal->detail};
  if (!refusal) refusal = bus_.publish(output.channel, bytes);
  if (refusal) return report(refusal->reason, refusal->detail, output.channel);

  monitor_.count_message(output.health, utime);
}

void Node::report(wire::Reason reason, std::string_view text, std::string_view channel) {
  monitor_.count_reason(channel, reason, text);
  announcer_.report(now(), reason, text, channel);
}

void Node::show(const WatchedCondition& watched) {
  const bool holds = watched.condition.holds();
  if (!monitor_.set_condition(watched.channel, watched.reason, holds, watched.text)) return;
  const std::string text = std::string(watched.text) + (holds ? "" : ": over");
  log(holds ? Level::kWarning : Level::kInfo, to_string(watched.reason), text, watched.channel);
}

/// One condition for all inputs that must not be silent.
void Node::show_silent_inputs() {
  const std::int64_t now_us = computer_clock_.monotonic_us();
  std::string silent;
  for (const auto& input : inputs_) {
    const Cadence cadence = input->options.cadence;
    const bool matters =
        cadence == Cadence::kExpected || (cadence == Cadence::kSteady && input->heard_us);
    const std::int64_t since_us = input->heard_us.value_or(connected_us_);
    if (!matters || now_us - since_us < kSilent_us) continue;
    silent += (silent.empty() ? "" : ", ") + input->channel;
  }

  const std::string text = "nothing comes on " + silent;
  WatchedCondition watched{wire::Reason::kSensorSilent, text, "", Condition({1, 1})};
  watched.condition.add(!silent.empty());
  show(watched);
}

health_t Node::health() {
  show_silent_inputs();
  for (const auto& input : inputs_) {
    monitor_.set_dropped(input->health, bus_.dropped(input->channel));
  }
  const DatagramFaults refused = bus_.refused_datagrams();
  monitor_.set_refused(refused);
  announcer_.report_refused(now(), refused);
  health_t report = monitor_.report(now());

  const ReceiveBuffer buffer = bus_.receive_buffer();
  report.receive_buffer_bytes = buffer.granted_bytes;
  report.receive_buffer_wanted_bytes = buffer.wanted_bytes;
  report.snapshot_utime = state_.saved_utime();
  report.journal_bytes = state_.journal_bytes();
  return report;
}

void Node::publish_health() {
  if (options_.publishes_health) bus_.publish("HEALTH", wire::encode_bytes(health()));
}

bool Node::takes(std::string_view channel) const {
  return std::any_of(inputs_.begin(), inputs_.end(),
                     [&](const auto& input) { return input->channel == channel; });
}

std::vector<std::string> Node::outputs() const {
  std::vector<std::string> names;
  for (const Output& output : outputs_) names.push_back(output.channel);
  return names;
}

std::vector<BoundChannel> Node::channels() const {
  std::vector<BoundChannel> bound;
  for (const auto& input : inputs_) bound.push_back({Flow::kIn, input->name});
  for (const Output& output : outputs_) bound.push_back({Flow::kOut, output.name});
  return bound;
}

const SequenceCounts& Node::sequence_counts(std::string_view channel) const {
  for (const auto& input : inputs_) {
    if (input->channel == channel) return input->sequence.counts();
  }
  throw std::logic_error(std::string(channel) + " is no input");
}

}  // namespace understory::bus
