// A service's place on the bus: typed messages in and out, ticks, state, health.
//
// Calls of an adapter in bind():
//   node.subscribe<LandmarkScan>("LANDMARKS", [this](const LandmarkScan& scan) { ... });
//   keyframes_ = node.advertise<Keyframe>("KEYFRAME");
//   node.every(1'000'000, [this](Utime now) { ... });
// and later keyframes_.publish(keyframe). Everything between bytes and values happens here: the
// guard, counting, time, the journal, the stamp `seq`.
#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <type_traits>
#include <utility>
#include <vector>

#include "common/bus/announcer.hpp"
#include "common/bus/bus.hpp"
#include "common/bus/channel_list.hpp"
#include "common/bus/clock.hpp"
#include "common/bus/condition.hpp"
#include "common/bus/health_monitor.hpp"
#include "common/bus/message_timers.hpp"
#include "common/bus/node_state.hpp"
#include "common/bus/sequence_tracker.hpp"
#include "common/bus/state_keeper.hpp"
#include "common/bus/state_store.hpp"
#include "common/bus/time_gate.hpp"
#include "common/wire/convert.hpp"

namespace understory::bus {

class Node;

/// Whether an input may be silent. Judged by the computer's clock, for HEALTH only: without any
/// input, message time does not advance.
enum class Cadence : std::uint8_t {
  kAny,       ///< It may be silent.
  kSteady,    ///< Not silent after its first message.
  kExpected,  ///< Never silent.
};

/// Options of an input.
struct SubscribeOptions {
  std::size_t queue_size = 30;  ///< Messages that may wait; when full, the oldest is dropped.
  /// One sender numbers its messages: duplicates and late messages are dropped. False for requests,
  /// which several processes may send.
  bool sequenced = true;
  /// Late messages reach the handler too: the service sorts them. Duplicates are dropped.
  bool takes_late = false;
  /// Its stamps advance the service's time, and a stamp far from it is refused. False for inputs
  /// from consumers of the service's output: their stamps follow the service's time, not a sensor
  /// clock that has jumped.
  bool timed = true;
  /// A larger message is refused before decoding (`too_large`): the size bounds the cost of a
  /// message.
  std::size_t most_bytes = kLargestMessage;
  bool journaled = true;            ///< Written to the journal: handled again after a restart.
  Cadence cadence = Cadence::kAny;  ///< HEALTH is not OK while it is silent for 2 s.
};

/// An output channel; copies share it. Stamps `seq`, counting from 0.
template <class T>
class Publisher {
 public:
  /// Without a channel; publish() must not be called.
  Publisher() = default;
  /// Sends a value. A value that is not finite, or that the bus refuses, is counted and not sent.
  /// Returns the size of the message [bytes] also where it was not sent, so that a recovery counts
  /// the same.
  std::size_t publish(const T& value) const;

 private:
  friend class Node;
  Publisher(Node* node, std::size_t output) : node_(node), output_(output) {}
  Node* node_ = nullptr;
  std::size_t output_ = 0;
};

/// Options of a node: names of channels, clock, saved state.
struct NodeOptions {
  std::string process;                            ///< As in HEALTH.
  std::string version;                            ///< As in HEALTH and CONFIG.
  std::string channel_suffix;                     ///< Suffix of every output, e.g. _ALT.
  std::vector<std::string> suffixed_inputs;       ///< Inputs that carry the suffix too.
  std::int64_t largest_clock_jump_us = 10000000;  ///< Limit of MessageClock.
  model::Utime snapshot_every_us = 30000000;      ///< Message time between two snapshots.
  int snapshot_every_events = 1000;               ///< Inputs between two snapshots.
  /// An input is `input_refused` if this many of its latest 32 messages were refused.
  int refused_of_last_32 = 16;
  bool publishes_health = true;  ///< HEALTH; LOG and CONFIG are always published.
};

/// A facade, hence the number of functions: adapters use channels, ticks and messages for people;
/// drivers use state, health and feed(). Its members own the state; the node itself decides which
/// messages reach the stage.
class Node {
 public:
  using Level = LogLevel;  ///< Severity of a line of LOG.

  /// `bus` must outlive it. `clock` is for HEALTH only.
  Node(Bus& bus, NodeOptions options, Clock clock);
  Node(const Node&) = delete;
  Node& operator=(const Node&) = delete;

  // For adapters.

  /// `handler` takes a T: a value of common/model or a wire type. If it throws, this is counted and
  /// reported, and the message is not handled again. Throws std::logic_error for a channel that is
  /// subscribed already.
  template <class T, class F>
  void subscribe(const std::string& channel, F handler, SubscribeOptions options = {});
  /// An output for values T of common/model or a wire type. Throws std::logic_error for a name that
  /// no channel can have.
  template <class T>
  Publisher<T> advertise(const std::string& channel);
  /// Calls `handler` with the due message time, before the message that advances time past it.
  void every(model::Utime period_us, std::function<void(model::Utime)> handler) {
    timers_.add(period_us, std::move(handler));
  }
  /// Newest stamp among the inputs; -1 before the first.
  model::Utime now() const { return time_.now(); }
  /// Publishes a line of LOG.
  void log(Level level, std::string_view code, std::string_view text,
           std::string_view channel = "") {
    announcer_.log(now(), level, code, text, channel);
  }
  /// Reports a fault: counted for HEALTH, and in LOG at a limited rate.
  void report(wire::Reason reason, std::string_view text, std::string_view channel = "");

  /// HEALTH is not OK as long as the condition holds; its beginning and its end are in LOG. Call it
  /// after each event, and after loading the state.
  void show(const WatchedCondition& watched);

  // For the drivers.

  /// `save`, `load` and `state_was_lost` of the stage; see Adapter.
  void keep_state(std::function<std::string()> save, std::function<void(const std::string&)> load,
                  std::function<void(std::int64_t)> lost);
  /// Loads the snapshot and handles the journal's messages without publishing. False: the state
  /// could not be loaded; the stage may be partly loaded and must be created again.
  bool recover(StateStore& store);
  /// Calls `state_was_lost` if the snapshot of an earlier state was lost.
  void tell_of_loss(const StateStore& store);
  /// From now on inputs are written to the store before they are handled.
  void journal_to(StateStore* store) { state_.journal_to(store); }
  /// Saves the state, where there is a store. A failure is reported.
  void save_snapshot();
  /// Subscribes on the bus: messages arrive from now on.
  void connect();
  /// Handles one message as if it came from the bus; false = no input has this channel.
  bool feed(const BusMessage& message);

  /// Whether a channel is an input.
  bool takes(std::string_view channel) const;
  /// Names of the outputs, suffix included; HEALTH, LOG and CONFIG are not among them.
  std::vector<std::string> outputs() const;
  /// Every input and output without suffix.
  std::vector<BoundChannel> channels() const;
  /// The message for HEALTH, as of now.
  health_t health();
  /// Publishes HEALTH, where the options allow it.
  void publish_health();
  /// Publishes CONFIG with the configuration in force.
  void publish_config(const std::string& toml) { announcer_.config(now(), toml); }
  /// The counts behind HEALTH.
  HealthMonitor& monitor() { return monitor_; }
  /// The options given to the constructor.
  const NodeOptions& options() const { return options_; }
  /// Sequence counts of an input. Throws std::logic_error for another channel.
  const SequenceCounts& sequence_counts(std::string_view channel) const;

  /// Sends an encoded message whose `seq` is stamped and returns its bytes; for Publisher.
  template <class Wire>
  std::size_t publish_wire(std::size_t output, Wire message);

 private:
  /// Reads the message's header, calls `admit`, and calls the handler where it returns true.
  using Admit = std::function<bool()>;
  using Take =
      std::function<std::optional<wire::Refusal>(std::span<const std::uint8_t>, const Admit&)>;
  struct Input {
    std::string name;     ///< Without suffix.
    std::string channel;  ///< With the suffix, where it carries one.
    SubscribeOptions options;
    Take take;
    SequenceTracker sequence;
    ChannelPace pace{-1, 0};
    WatchedCondition refused;              ///< Refused messages of this process.
    bool is_late = false;                  ///< Whether the present message is late.
    std::optional<std::int64_t> heard_us;  ///< Time of the latest message, computer's clock.
    std::size_t health = 0;
  };
  struct Output {
    std::string name;     ///< Without suffix.
    std::string channel;  ///< With the suffix.
    std::int64_t next_sequence = 0;
    std::size_t health = 0;
  };
  /// Origin of a message that is handled.
  enum class Source : std::uint8_t { kBus, kProven, kJournal };
  struct Stage {
    std::function<std::string()> save;
    std::function<void(const std::string&)> load;
    std::function<void(std::int64_t)> lost;
  };

  void add_input(const std::string& channel, Take take, SubscribeOptions options);
  std::size_t add_output(const std::string& channel);
  void handle(Input& input, const BusMessage& message);
  std::optional<wire::Refusal> take(Input& input, const BusMessage& message);
  bool admit(Input& input, const BusMessage& message);
  bool admit_sequence(Input& input, const wire::MessageHeader& header);
  bool admit_time(Input& input, const BusMessage& message, model::Utime utime);
  void start_at_jump(model::Utime utime);
  void feed_proven();
  void count_wrong(std::string_view channel);
  void show_silent_inputs();
  void send(Output& output, model::Utime utime, const wire::Bytes& bytes,
            const wire::WireType& type);
  bool is_recovering() const { return source_ == Source::kJournal; }
  void show_kept(const std::optional<wire::Refusal>& refusal);
  std::string save_state() const;
  void load_state(const std::string& bytes);

  Bus& bus_;
  NodeOptions options_;
  Clock computer_clock_;
  TimeGate time_;
  HealthMonitor monitor_;
  Announcer announcer_;
  std::vector<std::unique_ptr<Input>> inputs_;
  std::vector<Output> outputs_;
  MessageTimers timers_;
  Stage stage_;
  StateKeeper state_;
  Source source_ = Source::kBus;
  std::int64_t connected_us_ = 0;
};

template <class T, class F>
void Node::subscribe(const std::string& channel, F handler, SubscribeOptions options) {
  add_input(
      channel,
      [handler = std::move(handler)](std::span<const std::uint8_t> bytes,
                                     const Admit& admit) -> std::optional<wire::Refusal> {
        const wire::Result<T> value = wire::decode_message<T>(bytes);
        if (!value) return value.refusal();
        if (admit()) handler(*value);
        return std::nullopt;
      },
      options);
}

template <class T>
Publisher<T> Node::advertise(const std::string& channel) {
  return Publisher<T>(this, add_output(channel));
}

template <class Wire>
std::size_t Node::publish_wire(std::size_t output, Wire message) {
  message.seq = outputs_[output].next_sequence++;
  const wire::Bytes bytes = wire::encode_bytes(message);
  send(outputs_[output], message.utime, bytes, wire::wire_type_of<Wire>());
  return bytes.size();
}

template <class T>
std::size_t Publisher<T>::publish(const T& value) const {
  if constexpr (std::is_same_v<T, typename wire::WireOf<T>::type>) {
    return node_->publish_wire(output_, value);
  } else {
    return node_->publish_wire(output_, wire::to_wire(value));
  }
}

}  // namespace understory::bus
