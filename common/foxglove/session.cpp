#include "common/foxglove/session.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <nlohmann/json.hpp>
#include <utility>

#include "common/foxglove/json_text.hpp"
#include "common/foxglove/scene.hpp"
#include "common/terminal/printable.hpp"

namespace understory::foxglove {
namespace {

using Json = nlohmann::json;

constexpr char kMessageData = 0x01;  // Opcodes of the server's binary messages.
/// What clients may ask of servers that offer it.
constexpr std::array<std::string_view, 10> kOtherRequests{"advertise",
                                                          "unadvertise",
                                                          "getParameters",
                                                          "setParameters",
                                                          "subscribeParameterUpdates",
                                                          "unsubscribeParameterUpdates",
                                                          "subscribeConnectionGraph",
                                                          "unsubscribeConnectionGraph",
                                                          "fetchAsset",
                                                          "callService"};

std::string server_info(const SessionOptions& options) {
  JsonText out;
  out.begin_object();
  out.field("op", "serverInfo");
  out.field("name", terminal::printable(options.name));
  out.key("capabilities");
  out.raw("[]");
  out.key("metadata");
  out.raw("{}");
  if (!options.session_id.empty()) {
    out.field("sessionId", terminal::printable(options.session_id));
  }
  out.end_object();
  return out.take();
}

/// All topics; a channel's id is its topic's number + 1.
std::string advertisement() {
  JsonText out;
  out.begin_object();
  out.field("op", "advertise");
  out.key("channels");
  out.begin_array();
  for (const Topic& one : topics()) {
    out.begin_object();
    out.field("id", static_cast<int>(one.id) + 1);
    out.field("topic", one.name);
    out.field("encoding", "json");
    out.field("schemaName", one.schema_name);
    out.field("schema", schema_of(one.id));
    out.field("schemaEncoding", "jsonschema");
    out.end_object();
  }
  out.end_array();
  out.end_object();
  return out.take();
}

std::string status(std::string_view text) {
  JsonText out;
  out.begin_object();
  out.field("op", "status");
  out.field("level", 1);
  out.field("message", terminal::printable(text));
  out.end_object();
  return out.take();
}

void append_integer(std::string& out, std::uint64_t value, unsigned bytes) {
  for (unsigned i = 0; i < bytes; ++i) out.push_back(static_cast<char>(value >> (8U * i) & 0xFFU));
}

std::optional<std::uint32_t> number_of(const Json& value) {
  if (!value.is_number_unsigned()) return std::nullopt;
  const auto number = value.get<std::uint64_t>();
  if (number > 0xFFFFFFFFU) return std::nullopt;
  return static_cast<std::uint32_t>(number);
}

std::optional<std::uint32_t> number_in(const Json& object, const char* name) {
  if (!object.is_object()) return std::nullopt;
  const auto found = object.find(name);
  return found == object.end() ? std::nullopt : number_of(*found);
}

}  // namespace

/// A client's request with checked syntax.
struct Session::Request {
  enum class Kind : std::uint8_t { kSubscribe, kUnsubscribe, kOther, kMalformed };
  Kind kind = Kind::kMalformed;
  std::vector<std::pair<std::uint32_t, std::uint32_t>> subscriptions;  ///< (id, channel id).
  std::vector<std::uint32_t> ids;                                      ///< Subscriptions to end.

  static Request parse(std::string_view text);

 private:
  static Request subscribe(const Json& message);
  static Request unsubscribe(const Json& message);
};

Session::Request Session::Request::parse(std::string_view text) {
  const Json message = Json::parse(text, nullptr, false);
  if (!message.is_object()) return {};
  const auto op = message.find("op");
  if (op == message.end() || !op->is_string()) return {};
  const auto& name = op->get_ref<const std::string&>();
  if (name == "subscribe") return subscribe(message);
  if (name == "unsubscribe") return unsubscribe(message);
  if (std::ranges::find(kOtherRequests, name) == kOtherRequests.end()) return {};
  Request request;
  request.kind = Kind::kOther;
  return request;
}

Session::Request Session::Request::subscribe(const Json& message) {
  const auto list = message.find("subscriptions");
  if (list == message.end() || !list->is_array()) return {};
  Request request;
  for (const Json& one : *list) {
    const auto id = number_in(one, "id");
    const auto channel = number_in(one, "channelId");
    if (!id || !channel) return {};
    request.subscriptions.emplace_back(*id, *channel);
  }
  request.kind = Kind::kSubscribe;
  return request;
}

Session::Request Session::Request::unsubscribe(const Json& message) {
  const auto list = message.find("subscriptionIds");
  if (list == message.end() || !list->is_array()) return {};
  Request request;
  for (const Json& one : *list) {
    const auto id = number_of(one);
    if (!id) return {};
    request.ids.push_back(*id);
  }
  request.kind = Kind::kUnsubscribe;
  return request;
}

Session::Session(SessionOptions options) : options_(std::move(options)) {
  static const std::string all_topics = advertisement();
  replies_.push_back(server_info(options_));
  replies_.push_back(all_topics);
}

Taken Session::take_text(std::string_view text) {
  if (text.size() > options_.most_text_bytes) return refuse(Taken::kMalformed, "too long");
  return act(Request::parse(text));
}

Taken Session::take_binary(std::span<const std::uint8_t>) {
  return refuse(Taken::kNotSupported, "clients publish nothing here");
}

Taken Session::act(const Request& request) {
  switch (request.kind) {
    case Request::Kind::kSubscribe:
      return subscribe(request);
    case Request::Kind::kUnsubscribe:
      return unsubscribe(request);
    case Request::Kind::kOther:
      return refuse(Taken::kNotSupported, "not offered by this server");
    default:
      return refuse(Taken::kMalformed, "no message of the protocol");
  }
}

Taken Session::refuse(Taken why, std::string_view text) {
  ++(why == Taken::kMalformed ? counts_.malformed : counts_.not_supported);
  reply(status(text));
  return why;
}

Taken Session::subscribe(const Request& request) {
  Taken result = Taken::kDone;
  for (const auto& [id, channel] : request.subscriptions) {
    if (channel == 0 || channel > kTopics) {
      result = refuse(Taken::kMalformed, fmt::format("there is no channel {}", channel));
      continue;
    }
    const auto topic_id = static_cast<TopicId>(channel - 1);
    Line& to = line(topic_id);
    if (to.subscription || subscriptions_.contains(id)) {
      result = refuse(Taken::kMalformed,
                      fmt::format("channel {} or subscription {} is in use", channel, id));
      continue;
    }
    subscriptions_[id] = topic_id;
    to = {id, WaitingLine(topic(topic_id).has_state)};
  }
  return result;
}

Taken Session::unsubscribe(const Request& request) {
  Taken result = Taken::kDone;
  for (const std::uint32_t id : request.ids) {
    const auto found = subscriptions_.find(id);
    if (found == subscriptions_.end()) {
      result = refuse(Taken::kMalformed, fmt::format("there is no subscription {}", id));
      continue;
    }
    line(found->second) = {};
    subscriptions_.erase(found);
  }
  return result;
}

void Session::reply(std::string text) {
  if (replies_.size() < options_.most_replies) replies_.push_back(std::move(text));
}

void Session::offer(const Converted& message) {
  Line& to = line(message.topic);
  if (!to.subscription) return;
  counts_.dropped += to.waiting.offer(message, turns_++, options_.line);
}

std::optional<Outgoing> Session::next() {
  if (!replies_.empty()) {
    Outgoing out{false, std::move(replies_.front())};
    replies_.pop_front();
    return out;
  }

  Line* first = nullptr;
  for (Line& one : lines_) {
    if (!one.waiting.turn()) continue;
    if (first == nullptr || *one.waiting.turn() < *first->waiting.turn()) first = &one;
  }
  if (first == nullptr) return std::nullopt;
  const Converted message = first->waiting.pop();
  ++counts_.sent;

  Outgoing out{true, std::string(1, kMessageData)};
  out.bytes.reserve(13 + message.json->size());
  append_integer(out.bytes, *first->subscription, 4);
  append_integer(out.bytes, message.log_time_ns, 8);
  out.bytes += *message.json;
  return out;
}

std::vector<TopicId> Session::take_wanted() {
  const bool is_slow = waiting_bytes() > 0;
  std::vector<TopicId> wanted;
  for (const Topic& one : topics()) {
    WaitingLine& waiting = line(one.id).waiting;
    if (!waiting.wants_state(is_slow)) continue;
    if (waiting.expect_state()) ++counts_.resent;
    wanted.push_back(one.id);
  }
  return wanted;
}

bool Session::should_close() const {
  return counts_.malformed + counts_.not_supported >= options_.most_refused;
}

std::size_t Session::waiting_bytes() const {
  std::size_t bytes = 0;
  for (const Line& one : lines_) bytes += one.waiting.bytes();
  return bytes;
}

void bring_up_to_date(Session& session, const Converter& converter) {
  for (const TopicId id : session.take_wanted()) {
    if (const auto state = converter.state_of(id)) session.offer(*state);
  }
}

}  // namespace understory::foxglove
