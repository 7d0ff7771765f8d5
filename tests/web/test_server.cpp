#include <memory>
#include <random>

#include "common/web/request_checks.hpp"
#include "tests/catch.hpp"
#include "tests/web/socket_client.hpp"

namespace understory {
namespace {

using Catch::Matchers::Contains;
using web::Event;

web::ServerOptions options() {
  web::ServerOptions options;
  options.sockets = {{.path = "/live", .subprotocols = {}, .allowed_origins = {}},
                     {.path = "/other",
                      .subprotocols = {"new.v2", "old.v1"},
                      .allowed_origins = {"https://viewer.example"},
                      .most_message_bytes = 100}};
  options.request_timeout_s = 1;
  return options;
}

std::shared_ptr<const std::string> shared(std::string text) {
  return std::make_shared<const std::string>(std::move(text));
}

}  // namespace

TEST_CASE("which hosts, origins and subprotocols are taken", "[web]") {
  const std::vector<std::string> names = {"vehicle.local"};
  for (const char* host : {"localhost", "localhost:7680", "127.0.0.1:1", "[::1]:80", "10.1.2.3",
                           "vehicle.local", "vehicle.local:80"})
    CHECK(web::is_own_host(host, names));
  for (const char* host :
       {"", "evil.example", "localhost.evil.example", "127.0.0.1.evil.example", "[::1", "vehicle"})
    CHECK_FALSE(web::is_own_host(host, names));

  CHECK(web::is_allowed_origin("", "localhost:80", {}));
  CHECK(web::is_allowed_origin("http://localhost:80", "localhost:80", {}));
  CHECK(web::is_allowed_origin("https://a.example", "localhost:80", {"https://a.example"}));
  CHECK_FALSE(web::is_allowed_origin("http://localhost:81", "localhost:80", {}));
  CHECK_FALSE(web::is_allowed_origin("null", "localhost:80", {}));

  CHECK(web::chosen_subprotocol("b, a", {"a", "b"}) == "a");
  CHECK(web::chosen_subprotocol("c ,b", {"a", "b"}) == "b");
  CHECK(web::chosen_subprotocol("x,  b , y", {"a", "b"}) == "b");
  CHECK_FALSE(web::chosen_subprotocol("", {"a"}));
  CHECK_FALSE(web::chosen_subprotocol("a.v2,,", {"a"}));
  CHECK(web::path_of("/x?y=1") == "/x");
}

TEST_CASE("documents are served, and nothing else", "[web]") {
  web::Server server(options());
  server.set_document("/", {"text/html", "<p>page</p>"});
  CHECK_THAT(test::get(server.port(), "/?theme=dark"), Contains("200 OK") && Contains("<p>page"));
  CHECK_THAT(test::get(server.port(), "/", "localhost", "HEAD"),
             Contains("200 OK") && Contains("Content-Length: 11") && !Contains("<p>page"));
  CHECK_THAT(test::get(server.port(), "/../etc/passwd"), Contains("404"));
  CHECK_THAT(test::get(server.port(), "/", "localhost", "POST"), Contains("405"));
  server.set_document("/", {"text/html", "<p>newer</p>"});
  CHECK_THAT(test::get(server.port(), "/"), Contains("newer"));
  CHECK(server.counts().refused() == 0);

  CHECK_THAT(test::get(server.port(), "/", "evil.example"), Contains("403") && !Contains("newer"));
  CHECK(server.counts().refused_host == 1);
}

TEST_CASE("only the loopback interface, unless it is wanted", "[web]") {
  web::ServerOptions open = options();
  open.address = "0.0.0.0";
  CHECK_THROWS_WITH(web::Server(open), Contains("0.0.0.0") && Contains("other computers"));
  open.beyond_loopback = true;
  CHECK_NOTHROW(web::Server(open));
  open.address = "localhost.example";
  CHECK_THROWS_WITH(web::Server(open), Contains("localhost.example"));

  const web::Server first(options());
  web::ServerOptions same = options();
  same.port = first.port();
  CHECK_THROWS_WITH(web::Server(same), Contains(std::to_string(first.port())));
}

TEST_CASE("messages go both ways, in order", "[web]") {
  web::Server server(options());
  test::SocketClient client(server.port(), "/live");
  const auto opened = test::wait_for_events(server, 1);
  REQUIRE(opened.size() == 1);
  CHECK(opened[0].kind == Event::Kind::kOpened);
  CHECK(opened[0].path == "/live");

  // More than may wait at once: none is lost.
  for (int i = 0; i < 100; ++i) client.send(std::to_string(i));
  client.send_binary(std::string("\0\1", 2));
  const auto events = test::wait_for_events(server, 101);
  REQUIRE(events.size() == 101);
  for (int i = 0; i < 100; ++i) {
    CHECK(events[static_cast<std::size_t>(i)].kind == Event::Kind::kText);
    CHECK(events[static_cast<std::size_t>(i)].data == std::to_string(i));
  }
  CHECK(events.back().kind == Event::Kind::kBinary);
  CHECK(events.back().data == std::string("\0\1", 2));

  server.send_text(opened[0].client, shared("text"));
  server.send_binary(opened[0].client, shared(std::string(100'000, 'x')));
  CHECK(client.receive() == "text");
  CHECK(client.receive() == std::string(100'000, 'x'));
  server.close(opened[0].client, "enough");
  CHECK_FALSE(client.receive());
  CHECK(client.close_reason() == "enough");
  server.send_text(opened[0].client, shared("passed over"));
  server.send_text(12345, shared("nobody"));
  CHECK(server.counts().refused() == 0);
}

TEST_CASE("pages of elsewhere and clients without the subprotocol are refused", "[web]") {
  web::Server server(options());
  const auto connect = [&](const std::string& path, const std::string& origin,
                           const std::string& subprotocol) {
    return test::SocketClient(server.port(), path, origin, subprotocol).subprotocol();
  };
  const std::string own = "http://localhost:" + std::to_string(server.port());
  CHECK_NOTHROW(connect("/live", own, ""));
  CHECK_THROWS(connect("/live", "http://evil.example", ""));
  CHECK_THROWS(connect("/live", "https://viewer.example", ""));
  CHECK(server.counts().refused_origin == 2);
  CHECK(connect("/other", "https://viewer.example", "old.v1, new.v2") == "new.v2");
  CHECK(connect("/other", own, "old.v1") == "old.v1");
  CHECK_THROWS(connect("/other", own, "another"));
  CHECK_THROWS(connect("/other", own, ""));
  CHECK_THROWS(connect("/nowhere", own, ""));
  CHECK(server.counts().sockets == 3);
}

TEST_CASE("what is too large, malformed or slow is closed and counted", "[web]") {
  web::Server server(options());
  server.set_document("/", {"text/html", "page"});
  {
    test::SocketClient client(server.port(), "/other", "", "old.v1");
    client.send(std::string(101, 'x'));
    CHECK_FALSE(client.receive());
    CHECK(test::holds_soon([&] { return server.counts().too_large == 1; }));
  }
  {
    // An opcode that does not exist.
    test::SocketClient client(server.port(), "/live");
    client.send_raw(std::string("\x8b\x80\0\0\0\0", 6));
    CHECK_FALSE(client.receive());
    CHECK(test::holds_soon([&] { return server.counts().malformed == 1; }));
  }
  {
    // Text that is no UTF-8.
    test::SocketClient client(server.port(), "/live");
    client.send_raw(std::string("\x81\x82\0\0\0\0\xff\xfe", 8));
    CHECK_FALSE(client.receive());
    CHECK(test::holds_soon([&] { return server.counts().malformed == 2; }));
  }
  {
    test::RawClient client(server.port());
    client.send("GET / HTTP/1.1\r\nHost: localhost\r\nX: " + std::string(10'000, 'x') + "\r\n\r\n");
    client.receive_all();
    CHECK(test::holds_soon([&] { return server.counts().too_large == 2; }));
  }
  {
    test::RawClient client(server.port());
    client.send("\x16\x03\x01 not http at all\r\n\r\n");
    client.receive_all();
    CHECK(test::holds_soon([&] { return server.counts().malformed == 3; }));
  }
  {
    test::RawClient client(server.port());
    client.send("GET / HT");
    CHECK(client.receive_all().empty());
    CHECK(test::holds_soon([&] { return server.counts().too_slow == 1; }));
  }
  CHECK_THAT(test::get(server.port(), "/"), Contains("page"));
}

TEST_CASE("a client that takes nothing is closed, and holds up nobody", "[web]") {
  web::ServerOptions small = options();
  small.most_unsent_bytes = 20 << 20;
  web::Server server(small);
  test::SocketClient stalled(server.port(), "/live");
  const auto first = test::wait_for_events(server, 1);
  test::SocketClient quick(server.port(), "/live");
  const auto second = test::wait_for_events(server, 1);
  REQUIRE(first.size() == 1);
  REQUIRE(second.size() == 1);

  const auto megabyte = shared(std::string(1 << 20, 'x'));
  for (int i = 0; i < 40; ++i) {
    server.send_binary(first[0].client, megabyte);
    server.send_text(second[0].client, shared(std::to_string(i)));
    CHECK(quick.receive() == std::to_string(i));
  }
  CHECK(test::holds_soon([&] { return server.counts().overrun == 1; }));
  const auto events = test::wait_for_events(server, 1);
  CHECK(std::ranges::any_of(events, [&](const Event& event) {
    return event.kind == Event::Kind::kClosed && event.client == first[0].client;
  }));
}

TEST_CASE("clients that go while much is sent to them do no harm", "[web]") {
  web::Server server(options());
  const auto megabyte = shared(std::string(1 << 20, 'x'));
  for (int i = 0; i < 20; ++i) {
    test::SocketClient client(server.port(), "/live");
    // Among them are the last words of those before.
    web::ClientId id = 0;
    REQUIRE(test::holds_soon([&] {
      for (const Event& event : server.take_events()) {
        if (event.kind == Event::Kind::kOpened) id = event.client;
      }
      return id != 0;
    }));
    for (int k = 0; k < 4; ++k) server.send_binary(id, megabyte);
    // By itself, by a frame that is none, or sent away in the middle of a message.
    if (i % 3 == 0) client.send_raw("\xff\xff\xff");
    if (i % 3 != 1) continue;
    server.close(id, "in the middle");
    while (client.receive()) {
    }
    CHECK(client.close_reason() == "in the middle");
  }
  test::SocketClient client(server.port(), "/live");
  CHECK(test::holds_soon([&] { return server.counts().sockets == 21; }));
}

TEST_CASE("connections above the limit are closed at once", "[web]") {
  web::ServerOptions few = options();
  few.most_connections = 3;
  web::Server server(few);
  server.set_document("/", {"text/html", "page"});
  std::vector<std::unique_ptr<test::SocketClient>> clients;
  for (int i = 0; i < 3; ++i)
    clients.push_back(std::make_unique<test::SocketClient>(server.port(), "/live"));
  CHECK_THROWS(test::SocketClient(server.port(), "/live"));
  CHECK(server.counts().too_many == 1);
  clients.pop_back();
  CHECK(test::holds_soon(
      [&] { return test::get(server.port(), "/").find("page") != std::string::npos; }));
}

TEST_CASE("requests that drip in do not keep others out", "[web]") {
  web::ServerOptions few = options();
  few.most_connections = 8;
  few.request_timeout_s = 30;
  web::Server server(few);
  server.set_document("/", {"text/html", "page"});
  std::vector<std::unique_ptr<test::RawClient>> slow;
  const auto start = std::chrono::steady_clock::now();
  for (int i = 0; i < 50; ++i) {
    slow.push_back(std::make_unique<test::RawClient>(server.port()));
    for (const auto& one : slow) one->send("G");
    if (i % 10 != 9) continue;
    CHECK_THAT(test::get(server.port(), "/"), Contains("page"));
  }
  CHECK(std::chrono::steady_clock::now() - start < std::chrono::seconds(10));
  CHECK(server.counts().gave_way >= 40);
  CHECK(server.counts().too_many == 0);

  // A WebSocket keeps its place.
  test::SocketClient client(server.port(), "/live");
  for (int i = 0; i < 20; ++i) {
    slow.push_back(std::make_unique<test::RawClient>(server.port()));
    slow.back()->send("G");
  }
  client.send("still here");
  CHECK(test::holds_soon([&] {
    for (const Event& event : server.take_events()) {
      if (event.kind == Event::Kind::kText) return event.data == "still here";
    }
    return false;
  }));
}

TEST_CASE("random bytes on many connections leave the server alive", "[web]") {
  web::Server server(options());
  server.set_document("/", {"text/html", "page"});
  std::mt19937_64 random(5);
  for (int i = 0; i < 100; ++i) {
    std::string bytes(1 + random() % 300, '\0');
    for (char& byte : bytes) byte = static_cast<char>(random());
    if (i % 2 == 0) {
      test::RawClient(server.port()).send(bytes);
    } else {
      test::SocketClient(server.port(), "/live").send_raw(bytes);
    }
  }
  CHECK_THAT(test::get(server.port(), "/"), Contains("page"));
  server.take_events();
}

}  // namespace understory
