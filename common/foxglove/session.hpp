// One client of the Foxglove WebSocket protocol, without the socket.
//
// The protocol is the one of github.com/foxglove/ws-protocol (docs/spec.md); subprotocols
// foxglove.websocket.v1 and foxglove.sdk.v1 have the same messages. A session takes the client's
// messages and returns the messages to send; the owner of the socket transports both:
//
//   session.take_text(text) or session.take_binary(bytes)  for what comes in,
//   session.offer(converted)                               for every message of a Converter,
//   bring_up_to_date(session, converter)                   after each of these,
//   while the socket can be written: session.next().
#pragma once

#include <array>
#include <cstdint>
#include <deque>
#include <map>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "common/foxglove/converter.hpp"
#include "common/foxglove/waiting_line.hpp"

namespace understory::foxglove {

/// Names of the protocol in Sec-WebSocket-Protocol; a client without any of them is refused.
inline constexpr std::array<std::string_view, 2> kSubprotocols{"foxglove.sdk.v1",
                                                               "foxglove.websocket.v1"};

/// One WebSocket message to the client.
struct Outgoing {
  bool is_binary = false;
  std::string bytes;
};

/// Server information and limits of a session.
struct SessionOptions {
  std::string name = "understory";
  std::string session_id = {};               ///< Tells runs of the server apart; empty = none.
  std::size_t most_text_bytes = 64 * 1024;   ///< Of one message of the client.
  LineBounds line = {256, 8 * 1024 * 1024};  ///< Of each topic, what may wait.
  std::size_t most_replies = 64;             ///< Status messages that wait.
  std::uint64_t most_refused = 100;          ///< Then the client should go.
};

/// Result of a client's message.
enum class Taken : std::uint8_t {
  kDone,
  kNotSupported,  ///< Part of the protocol, but not offered; the client gets a status message.
  kMalformed,     ///< Not part of the protocol, or against its rules; likewise.
};

/// Counts of a session.
struct SessionCounts {
  std::uint64_t sent = 0;     ///< Messages of topics returned by next().
  std::uint64_t dropped = 0;  ///< Messages of topics dropped because the client was too slow.
  std::uint64_t resent = 0;   ///< Number of requests for the whole state after a loss.
  std::uint64_t malformed = 0;
  std::uint64_t not_supported = 0;
};

/// Bounded memory: for each topic as in `SessionOptions`. No message of a client causes an
/// exception.
class Session {
 public:
  /// A session whose first messages are serverInfo and the list of all topics.
  explicit Session(SessionOptions options = {});

  /// Takes a text message of the client.
  Taken take_text(std::string_view text);
  /// Takes a binary message of the client: always refused, because clients may not publish.
  Taken take_binary(std::span<const std::uint8_t> bytes);
  /// Queues a message if the client subscribed its topic; O(1) except for dropping.
  void offer(const Converted& message);
  /// The next message to send: replies first, then topics in the order in which they came.
  std::optional<Outgoing> next();

  /// Topics whose state (`Converter::state_of`) this client needs now, each once; offer it next.
  std::vector<TopicId> take_wanted();
  /// Whether the client wants messages of the topic.
  bool is_subscribed(TopicId id) const { return line(id).subscription.has_value(); }
  /// Whether so many of its messages were refused that the connection should be closed.
  bool should_close() const;
  /// Bytes of messages that wait.
  std::size_t waiting_bytes() const;
  /// Counts so far.
  const SessionCounts& counts() const { return counts_; }

 private:
  /// The state of one topic for this client.
  struct Line {
    std::optional<std::uint32_t> subscription;  ///< The client's subscription id.
    WaitingLine waiting;
  };
  struct Request;

  Line& line(TopicId id) { return lines_[static_cast<std::size_t>(id)]; }
  const Line& line(TopicId id) const { return lines_[static_cast<std::size_t>(id)]; }
  Taken act(const Request& request);
  Taken refuse(Taken why, std::string_view text);
  Taken subscribe(const Request& request);
  Taken unsubscribe(const Request& request);
  void reply(std::string text);

  SessionOptions options_;
  std::deque<std::string> replies_;
  std::array<Line, kTopics> lines_;
  std::map<std::uint32_t, TopicId> subscriptions_;  ///< By the client's id.
  std::uint64_t turns_ = 0;
  SessionCounts counts_;
};

/// Offers the state of the topics for which the client needs it.
void bring_up_to_date(Session& session, const Converter& converter);

}  // namespace understory::foxglove
