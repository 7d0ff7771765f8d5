#include <cstring>
#include <random>

#include "common/foxglove/session.hpp"
#include "tests/catch.hpp"
#include "tests/foxglove/schema_check.hpp"
#include "tests/foxglove/shown_scene.hpp"
#include "tests/foxglove/synthetic_drive.hpp"

namespace understory::foxglove {
namespace {

using Json = nlohmann::json;

Converted message_of(TopicId topic, std::uint64_t time_ns, std::string text) {
  return {topic, time_ns, time_ns, std::make_shared<const std::string>(std::move(text))};
}

std::string subscribe_text(std::uint32_t id, TopicId topic) {
  return Json{{"op", "subscribe"},
              {"subscriptions", {{{"id", id}, {"channelId", static_cast<int>(topic) + 1}}}}}
      .dump();
}

std::vector<Outgoing> drained(Session& session) {
  std::vector<Outgoing> all;
  while (auto one = session.next()) all.push_back(*std::move(one));
  return all;
}

template <class Integer>
Integer integer_at(const std::string& bytes, std::size_t offset) {
  Integer value{};
  std::memcpy(&value, bytes.data() + offset, sizeof(value));
  return value;
}

TEST_CASE("a client is told what there is") {
  SessionOptions options;
  options.name = "a \"name\"";
  options.session_id = "17";
  Session session(options);
  const auto greeting = drained(session);
  REQUIRE(greeting.size() == 2);
  const Json info = Json::parse(greeting[0].bytes);
  REQUIRE(info["op"] == "serverInfo");
  REQUIRE(info["name"] == "a \"name\"");
  REQUIRE(info["sessionId"] == "17");
  REQUIRE(info["capabilities"] == Json::array());
  const Json list = Json::parse(greeting[1].bytes);
  REQUIRE(list["op"] == "advertise");
  REQUIRE(list["channels"].size() == kTopics);
  for (const Json& channel : list["channels"]) {
    REQUIRE(channel["encoding"] == "json");
    REQUIRE(Json::parse(channel["schema"].get<std::string>())["title"] == channel["schemaName"]);
  }
}

TEST_CASE("a subscribed topic comes as binary messages, others do not") {
  Session session;
  drained(session);
  REQUIRE(session.take_text(subscribe_text(77, TopicId::kLog)) == Taken::kDone);
  REQUIRE(session.is_subscribed(TopicId::kLog));
  session.offer(message_of(TopicId::kLog, 0x0102030405060708U, "{\"a\":1}"));
  session.offer(message_of(TopicId::kPose, 1, "{}"));
  const auto out = drained(session);
  REQUIRE(out.size() == 1);
  REQUIRE(out[0].is_binary);
  REQUIRE(out[0].bytes[0] == 1);
  REQUIRE(integer_at<std::uint32_t>(out[0].bytes, 1) == 77);
  REQUIRE(integer_at<std::uint64_t>(out[0].bytes, 5) == 0x0102030405060708U);
  REQUIRE(out[0].bytes.substr(13) == "{\"a\":1}");

  session.offer(message_of(TopicId::kLog, 1, "{}"));
  REQUIRE(session.take_text(R"({"op":"unsubscribe","subscriptionIds":[77]})") == Taken::kDone);
  REQUIRE(drained(session).empty());
  REQUIRE(session.waiting_bytes() == 0);
  // The id is free again.
  REQUIRE(session.take_text(subscribe_text(77, TopicId::kPose)) == Taken::kDone);
}

TEST_CASE("what breaks the rules is refused, counted and answered") {
  Session session;
  drained(session);
  REQUIRE(session.take_text(subscribe_text(1, TopicId::kLog)) == Taken::kDone);
  for (const std::string text :
       {"", "{", "[]", "1", "{}", R"({"op":1})", R"({"op":"dance"})", R"({"op":"subscribe"})",
        R"({"op":"subscribe","subscriptions":[{"id":-1,"channelId":1}]})",
        R"({"op":"subscribe","subscriptions":[{"id":4294967296,"channelId":1}]})",
        R"({"op":"subscribe","subscriptions":[{"id":2,"channelId":0}]})",
        R"({"op":"subscribe","subscriptions":[{"id":2,"channelId":9999}]})",
        R"({"op":"subscribe","subscriptions":[{"id":2.5,"channelId":1}]})",
        R"({"op":"subscribe","subscriptions":[7]})",
        R"({"op":"unsubscribe","subscriptionIds":[5]})",
        R"({"op":"unsubscribe","subscriptionIds":["a"]})"}) {
    INFO(text);
    REQUIRE(session.take_text(text) == Taken::kMalformed);
    const auto answers = drained(session);
    REQUIRE(answers.size() == 1);
    REQUIRE(Json::parse(answers[0].bytes)["op"] == "status");
  }
  // Each subscription id and each channel once.
  REQUIRE(session.take_text(subscribe_text(1, TopicId::kPose)) == Taken::kMalformed);
  REQUIRE(session.take_text(subscribe_text(2, TopicId::kLog)) == Taken::kMalformed);
  REQUIRE(session.take_text(std::string(1 << 20, '[')) == Taken::kMalformed);
  REQUIRE(session.take_text(std::string(60'000, '[')) == Taken::kMalformed);
  REQUIRE(session.take_text(R"({"op":"getParameters"})") == Taken::kNotSupported);
  REQUIRE(session.take_binary({}) == Taken::kNotSupported);
  REQUIRE(session.counts().malformed == 20);
  REQUIRE(session.counts().not_supported == 2);
  REQUIRE_FALSE(session.should_close());
  for (int i = 0; i < 100; ++i) session.take_text("?");
  REQUIRE(session.should_close());
  REQUIRE(drained(session).size() <= SessionOptions{}.most_replies);
}

TEST_CASE("a slow client gets the newest of a topic, and it is counted what it missed") {
  Session session;
  drained(session);
  session.take_text(subscribe_text(1, TopicId::kScan));
  session.take_text(subscribe_text(2, TopicId::kLog));
  for (int i = 0; i < 1000; ++i) {
    session.offer(message_of(TopicId::kScan, 1, std::to_string(i)));
    session.offer(message_of(TopicId::kLog, 1, std::to_string(i)));
  }
  const auto out = drained(session);
  REQUIRE(out.size() == 1 + SessionOptions{}.line.messages);
  REQUIRE(out[0].bytes.substr(13) == "999");
  REQUIRE(out.back().bytes.substr(13) == "999");
  REQUIRE(session.counts().dropped == 999 + 1000 - SessionOptions{}.line.messages);
  REQUIRE(session.counts().sent == out.size());
}

TEST_CASE("waiting messages are bounded in bytes") {
  SessionOptions options;
  options.line.bytes = 1000;
  Session session(options);
  drained(session);
  session.take_text(subscribe_text(1, TopicId::kLog));
  for (int i = 0; i < 100; ++i) {
    session.offer(message_of(TopicId::kLog, 1, std::string(90, 'x')));
    REQUIRE(session.waiting_bytes() <= 1000);
  }
  session.offer(message_of(TopicId::kLog, 1, std::string(5000, 'x')));
  REQUIRE(drained(session).size() == 1);
}

/// A client that reads only now and then, of a whole drive.
TEST_CASE("a slow client's scene is that of the converter once it has caught up") {
  SessionOptions options;
  options.line.messages = 3;
  Session session(options);
  drained(session);
  Converter converter;
  test::ShownScene shown;
  std::size_t handled = 0;
  std::mt19937_64 random(4);
  const auto read = [&] {
    while (const auto out = session.next()) {
      if (out->is_binary) shown.take(out->bytes.substr(13));
    }
  };

  for (const io::LogEvent& event : test::synthetic_drive(150)) {
    // It comes in the middle.
    if (++handled == 400) session.take_text(subscribe_text(9, TopicId::kLandmarks));
    for (const auto& one : converter.take(event.channel, event.data, event.utime)) {
      session.offer(one);
    }
    bring_up_to_date(session, converter);
    if (random() % 100 == 0) read();
  }
  read();
  bring_up_to_date(session, converter);
  read();

  REQUIRE(session.counts().dropped > 0);
  REQUIRE(session.counts().resent > 0);
  test::ShownScene whole;
  whole.take(*converter.state_of(TopicId::kLandmarks)->json);
  REQUIRE(whole.landmarks() > 30);
  REQUIRE(shown.content() == whole.content());
}

TEST_CASE("a client that comes late gets what it needs at once") {
  Converter converter;
  for (const io::LogEvent& event : test::synthetic_drive(60)) {
    converter.take(event.channel, event.data, event.utime);
  }
  Session session;
  drained(session);
  std::size_t with_state = 0;
  for (const Topic& one : topics()) {
    session.take_text(subscribe_text(static_cast<std::uint32_t>(one.id), one.id));
    with_state += one.has_state && converter.state_of(one.id) ? 1 : 0;
  }
  bring_up_to_date(session, converter);
  REQUIRE(with_state > 4);
  REQUIRE(drained(session).size() == with_state);
  bring_up_to_date(session, converter);
  REQUIRE(drained(session).empty());
}

TEST_CASE("whatever a client sends, a session goes on") {
  std::mt19937_64 random(11);
  const std::string alphabet = "{}[]\",:0123456789eE.-+ opsubcrichanlIdtr\\u\xff\x01";
  Session session;
  const std::string good =
      R"({"op":"subscribe","subscriptions":[{"id":1,"channelId":3},{"id":2,"channelId":4}]})";
  for (int i = 0; i < 20'000; ++i) {
    std::string text;
    if (i % 2 == 0) {
      text = good;
      for (std::uint64_t k = random() % 4; k > 0; --k) {
        text[random() % text.size()] = alphabet[random() % alphabet.size()];
      }
      if (random() % 3 == 0) text.resize(random() % text.size());
    } else {
      for (std::uint64_t k = random() % 60; k > 0; --k)
        text += alphabet[random() % alphabet.size()];
    }
    session.take_text(text);
    std::vector<std::uint8_t> bytes(random() % 20, static_cast<std::uint8_t>(random()));
    session.take_binary(bytes);
    if (i % 50 == 0) {
      session.take_text(R"({"op":"unsubscribe","subscriptionIds":[1,2]})");
      for (const Outgoing& out : drained(session)) {
        REQUIRE_FALSE(out.is_binary);
        REQUIRE(Json::parse(out.bytes).contains("op"));
      }
    }
  }
}

}  // namespace
}  // namespace understory::foxglove
