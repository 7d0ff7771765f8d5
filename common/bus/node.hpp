// A service's place on the bus: typed messages in and out, ticks, state, health.
//
// What an adapter calls when it is bound:
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

/// Whether an input may be silent. By the computer's clock and for HEALTH only: where nothing comes
/// at all, message time stands still.
enum class Cadence : std::uint8_t {
  kAny,       ///< It may.
  kSteady,    ///< Not after its first message.
  kExpected,  ///< Not at all.
};

/// How an input is taken.
struct SubscribeOptions {
  std::size_t queue_size = 30;  ///< Messages that may wait; when full, the oldest is dropped.
  /// One sender numbers its messages: duplicates and late comers are dropped. False for requests,
  /// which anybody may send.
  bool sequenced = true;
  /// Late comers are handed on, too: the service puts them in order. Duplicates are dropped.
  bool takes_late = false;
  /// Its stamps move the service's time, and one far from it is refused. False for what comes back
  /// from those who take the service's output: its stamps are on the service's time, which is not
  /// that of sensors whose clocks have jumped.
  bool timed = true;
  /// A larger message is refused before anything looks at it (`too_large`): what a message may cost
  /// follows from its size.
  std::size_t most_bytes = kLargestMessage;
  bool journaled = true;            ///< Part of the state: fed again after a restart.
  Cadence cadence = Cadence::kAny;  ///< HEALTH is not OK while it is silent for 2 s.
};

/// An output channel; copies share it. Stamps `seq`, counting from 0.
template <class T>
class Publisher {
 public:
  /// Without a channel: publish() must not be called.
  Publisher() = default;
  /// Sends a value. One that is not finite, or that the bus refuses, is counted and not sent.
  /// Returns the bytes of the message, whether it was sent or not: a state that is recovered counts
  /// as the first run did.
  std::size_t publish(const T& value) const;

 private:
  friend class Node;
  Publisher(Node* node, std::size_t output) : node_(node), output_(output) {}
  Node* node_ = nullptr;
  std::size_t output_ = 0;
};

/// How a node names its channels, believes stamps and keeps its state.
struct NodeOptions {
  std::string process;                            ///< As in HEALTH.
  std::string version;                            ///< As in HEALTH and CONFIG.
  std::string channel_suffix;                     ///< Of every output, e.g. _ALT.
  std::vector<std::string> suffixed_inputs;       ///< Inputs that carry the suffix too.
  std::int64_t largest_clock_jump_us = 10000000;  ///< MessageClock's.
  model::Utime snapshot_every_us = 30000000;      ///< Message time between two snapshots.
  int snapshot_every_events = 1000;               ///< Inputs between two snapshots.
  /// Refused messages of the latest 32 of an input with which it is `input_refused`.
  int refused_of_last_32 = 16;
  bool publishes_health = true;  ///< HEALTH; LOG and CONFIG are always published.
};

/// A facade, hence the number of functions: adapters see channels, ticks and messages for people;
/// drivers see state, health and the feed. What it does is owned by its members; it decides which
/// messages reach the stage.
class Node {
 public:
  using Level = LogLevel;  ///< How urgent a line of LOG is.

  /// `bus` must outlive it. `clock` is for HEALTH only.
  Node(Bus& bus, NodeOptions options, Clock clock);
  Node(const Node&) = delete;
  Node& operator=(const Node&) = delete;

  // For adapters.

  /// `handler` takes a T: a value of common/model or a wire type. It may throw: counted, reported,
  /// the message is done with. Throws std::logic_error for a channel that is subscribed already.
  template <class T, class F>
  void subscribe(const std::string& channel, F handler, SubscribeOptions options = {});
  /// An output for values T of common/model or a wire type. Throws std::logic_error for a name that
  /// no channel can have.
  template <class T>
  Publisher<T> advertise(const std::string& channel);
  /// Called with the time that is due, in message time: before the message that moves time past it.
  void every(model::Utime period_us, std::function<void(model::Utime)> handler) {
    timers_.add(period_us, std::move(handler));
  }
  /// Newest stamp among the inputs; -1 before the first.
  model::Utime now() const { return time_.now(); }
  /// Something a person should read: LOG.
  void log(Level level, std::string_view code, std::string_view text,
           std::string_view channel = "") {
    announcer_.log(now(), level, code, text, channel);
  }
  /// Something is wrong: counted for HEALTH, and LOG at a limited rate.
  void report(wire::Reason reason, std::string_view text, std::string_view channel = "");

  /// HEALTH is not OK as long as the condition holds; its beginning and its end are in LOG. To be
  /// called after each event, and after the state was loaded.
  void show(const WatchedCondition& watched);

  // For the drivers.

  /// `save`, `load` and `state_was_lost` of the stage; see Adapter.
  void keep_state(std::function<std::string()> save, std::function<void(const std::string&)> load,
                  std::function<void(std::int64_t)> lost);
  /// Loads the snapshot and feeds the journal, publishing nothing. False: the state could not be
  /// loaded; the stage may be half loaded and must be made anew.
  bool recover(StateStore& store);
  /// Where no snapshot is left of a state that was there, the stage is told.
  void tell_of_loss(const StateStore& store);
  /// From now on inputs are written to the store before they are handled.
  void journal_to(StateStore* store) { state_.journal_to(store); }
  /// Saves the state, where there is a store. A failure is reported.
  void save_snapshot();
  /// Subscribes on the bus: from now on messages come.
  void connect();
  /// Handles one message as if it came from the bus; false = no input has this channel.
  bool feed(const BusMessage& message);

  /// Whether a channel is an input.
  bool takes(std::string_view channel) const;
  /// Names of the outputs, suffix included; HEALTH, LOG and CONFIG are not among them.
  std::vector<std::string> outputs() const;
  /// Every input and output as the adapter names it, without suffix.
  std::vector<BoundChannel> channels() const;
  /// The message for HEALTH, as of now.
  health_t health();
  /// Publishes HEALTH, where the options allow it.
  void publish_health();
  /// Publishes CONFIG with the configuration in force.
  void publish_config(const std::string& toml) { announcer_.config(now(), toml); }
  /// The counts behind HEALTH.
  HealthMonitor& monitor() { return monitor_; }
  /// As given to the constructor.
  const NodeOptions& options() const { return options_; }
  /// Sequence counts of an input. Throws std::logic_error for another channel.
  const SequenceCounts& sequence_counts(std::string_view channel) const;

  /// Sends an encoded message whose `seq` is stamped and returns its bytes; for Publisher.
  template <class Wire>
  std::size_t publish_wire(std::size_t output, Wire message);

 private:
  /// Takes the message's header to `admit`; calls the handler where that agrees.
  using Admit = std::function<bool()>;
  using Take =
      std::function<std::optional<wire::Refusal>(std::span<const std::uint8_t>, const Admit&)>;
  struct Input {
    std::string name;     ///< As the adapter calls it.
    std::string channel;  ///< With the suffix, where it carries one.
    SubscribeOptions options;
    Take take;
    SequenceTracker sequence;
    ChannelPace pace{-1, 0};
    WatchedCondition refused;              ///< Of its latest messages; of this process.
    bool is_late = false;                  ///< The message that is being handled.
    std::optional<std::int64_t> heard_us;  ///< The latest one, on the computer's clock.
    std::size_t health = 0;
  };
  struct Output {
    std::string name;     ///< As the adapter calls it.
    std::string channel;  ///< With the suffix.
    std::int64_t next_sequence = 0;
    std::size_t health = 0;
  };
  /// Where a message that is fed comes from.
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
