#include <algorithm>
#include <memory>
#include <thread>

#include "common/bus/device.hpp"
#include "common/bus/memory_bus.hpp"
#include "common/bus/service.hpp"
#include "services/viewer/adapter.hpp"
#include "tests/catch.hpp"
#include "tests/viewer/page_replica.hpp"
#include "tests/web/socket_client.hpp"
#include "understory/health_t.hpp"
#include "understory/log_t.hpp"

namespace understory {
namespace {

using Catch::Matchers::Contains;

/// The process on a memory bus, opened as run_service opens it.
class LiveViewer {
 public:
  LiveViewer()
      : hosted_(viewer::viewer_service(), bus_, bus::system_clock(), "[page]\nport = 0\n", "test") {
    bus_.subscribe("LOG", 0, [this](const bus::BusMessage& message) {
      const auto line = wire::decode_message<log_t>(message.bytes);
      if (line && line->code == "page") url_ = line->text;
    });
    device().open();
    hosted_.node().connect();
    work();
  }
  bus::Device& device() { return dynamic_cast<bus::Device&>(hosted_.adapter()); }
  std::uint16_t port() const {
    return static_cast<std::uint16_t>(std::stoi(url_.substr(url_.rfind(':') + 1)));
  }
  void work() {
    while (bus_.handle_one(0)) {
    }
    device().attend(bus::system_clock().monotonic_us());
  }
  template <class T>
  void publish(const std::string& channel, const T& value) {
    bus_.publish(channel, wire::encode_message(value));
  }
  bus::HostedService& hosted() { return hosted_; }

 private:
  bus::MemoryBus bus_;
  bus::HostedService hosted_;
  std::string url_;
};

}  // namespace

TEST_CASE("messages on the bus come out of the WebSocket", "[viewer]") {
  LiveViewer process;
  test::SocketClient client(process.port(), "/live");
  test::PageReplica page;
  const auto exchange_until = [&](auto done) {
    bool is_done = false;
    std::thread browser([&] {
      while (!is_done) {
        const auto message = client.receive();
        if (!message) return;
        const test::PageFrame frame(*message);
        page.take(frame);
        if (frame.header.at("kind") == "frame")
          client.send(nlohmann::json{{"ack", frame.header.at("seq")}}.dump());
        is_done = done();
      }
    });
    const auto end = std::chrono::steady_clock::now() + std::chrono::seconds(10);
    while (!is_done && std::chrono::steady_clock::now() < end) {
      process.work();
      std::this_thread::sleep_for(std::chrono::milliseconds(2));
    }
    browser.join();
    return is_done;
  };

  model::MapDelta delta;
  delta.version = 1;
  for (std::uint64_t i = 1; i <= 50; ++i) {
    model::MapLandmark one;
    one.id = (1ULL << model::kLandmarkCounterBits) | i;
    one.position_m = {static_cast<double>(i), 2.0};
    one.observation_count = 1;
    delta.added.push_back(one);
  }
  process.publish("MAP_DELTA", delta);
  model::SlamPose pose;
  pose.utime = 1000;
  pose.covariance = 1e-4 * Eigen::Matrix3d::Identity();
  process.publish("SLAM_POSE", pose);
  health_t health{};
  health.process = "ghost";
  health.state = health_t::STATE_OK;
  health.pid = 0x7fffffff;  // No such process.
  health.channels.resize(1);
  health.channels[0].channel = "HAUNT";
  health.channels[0].rate_hz = 5.0;
  health.num_channels = 1;
  process.publish("HEALTH", health);

  CHECK(exchange_until([&] {
    return page.landmarks.size() == 50 && page.parts.contains("verdict") &&
           page.parts["verdict"]["state"] == "ok";
  }));
  CHECK(exchange_until([&] {
    return page.parts.contains("processes") && page.parts["processes"].size() == 1 &&
           page.parts["processes"][0]["state"] == "silent";
  }));
  CHECK(page.parts["processes"][0]["channels"][0]["rate_hz"] == 5.0);
  CHECK(page.landmarks.at(0).id == delta.added[0].id);
  CHECK(test::holds_soon([&] {
    process.work();
    return test::get(process.port(), "/health.json").find("\"pages\": 1") != std::string::npos;
  }));
}

TEST_CASE("what is malformed on the bus is refused and the page lives", "[viewer]") {
  LiveViewer process;
  process.hosted().node();
  bus::MemoryBus bus;
  test::SocketClient client(process.port(), "/live");
  client.send("not of the protocol");
  for (int i = 0; i < 200; ++i) {
    process.work();
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
  }
  while (client.receive()) {
  }
  CHECK(client.close_reason() == "not a JSON object");
  CHECK_THAT(test::get(process.port(), "/"), Contains("200 OK") && Contains("Understory"));
}

TEST_CASE("web clients that are refused are told of in HEALTH", "[viewer]") {
  LiveViewer process;
  const auto is_told = [&] {
    process.work();
    const health_t health = process.hosted().node().health();
    return std::ranges::any_of(health.reasons, [](const reason_count_t& one) {
      return one.reason == "client_refused" && one.count > 0;
    });
  };
  CHECK_FALSE(is_told());
  test::RawClient client(process.port());
  client.send("GET / HTTP/1.1\r\nHost: elsewhere.example\r\n\r\n");
  CHECK(test::holds_soon(is_told));
}

}  // namespace understory
