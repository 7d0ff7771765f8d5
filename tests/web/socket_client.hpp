// A client that may also misbehave.
#pragma once

#include <boost/asio/connect.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <boost/beast/core.hpp>
#include <boost/beast/http.hpp>
#include <boost/beast/websocket.hpp>
#include <chrono>
#include <optional>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "common/web/server.hpp"

namespace understory::test {

namespace beast = boost::beast;
using Tcp = boost::asio::ip::tcp;

/// Bytes to and from a port of this computer.
class RawClient {
 public:
  explicit RawClient(std::uint16_t port) : socket_(context_) {
    socket_.connect({boost::asio::ip::make_address("127.0.0.1"), port});
  }
  void send(const std::string& bytes) {
    boost::system::error_code ignored;
    boost::asio::write(socket_, boost::asio::buffer(bytes), ignored);
  }
  /// All that comes until the server closes, or nothing for 3 s.
  std::string receive_all() {
    const timeval limit{3, 0};
    ::setsockopt(socket_.native_handle(), SOL_SOCKET, SO_RCVTIMEO, &limit, sizeof(limit));
    std::string all;
    char bytes[4096];
    while (true) {
      const auto count = ::recv(socket_.native_handle(), bytes, sizeof(bytes), 0);
      if (count <= 0) return all;
      all.append(bytes, static_cast<std::size_t>(count));
    }
  }

 private:
  boost::asio::io_context context_;
  Tcp::socket socket_;
};

/// The whole answer to a request for `path`.
inline std::string get(std::uint16_t port, const std::string& path,
                       const std::string& host = "localhost", const std::string& verb = "GET") {
  RawClient client(port);
  client.send(verb + " " + path + " HTTP/1.1\r\nHost: " + host + "\r\nConnection: close\r\n\r\n");
  return client.receive_all();
}

/// A WebSocket, used one call after the other.
class SocketClient {
 public:
  /// Throws boost::system::system_error where it is refused.
  SocketClient(std::uint16_t port, const std::string& path, const std::string& origin = "",
               const std::string& subprotocol = "")
      : socket_(context_) {
    socket_.next_layer().connect({boost::asio::ip::make_address("127.0.0.1"), port});
    const timeval limit{5, 0};
    ::setsockopt(socket_.next_layer().native_handle(), SOL_SOCKET, SO_RCVTIMEO, &limit,
                 sizeof(limit));
    socket_.set_option(
        beast::websocket::stream_base::decorator([&](beast::websocket::request_type& request) {
          if (!origin.empty()) request.set(beast::http::field::origin, origin);
          if (!subprotocol.empty())
            request.set(beast::http::field::sec_websocket_protocol, subprotocol);
        }));
    beast::websocket::response_type response;
    socket_.handshake(response, "localhost:" + std::to_string(port), path);
    subprotocol_ = std::string(response[beast::http::field::sec_websocket_protocol]);
  }

  void send(const std::string& text) {
    socket_.text(true);
    socket_.write(boost::asio::buffer(text));
  }
  void send_binary(const std::string& bytes) {
    socket_.binary(true);
    socket_.write(boost::asio::buffer(bytes));
  }
  /// The next message; none where the server has closed.
  std::optional<std::string> receive() {
    beast::flat_buffer buffer;
    beast::error_code error;
    socket_.read(buffer, error);
    if (error) return std::nullopt;
    return beast::buffers_to_string(buffer.data());
  }
  /// Bytes that are no frame.
  void send_raw(const std::string& bytes) {
    boost::asio::write(socket_.next_layer(), boost::asio::buffer(bytes));
  }
  std::string close_reason() const { return std::string(socket_.reason().reason.c_str()); }
  const std::string& subprotocol() const { return subprotocol_; }

 private:
  boost::asio::io_context context_;
  beast::websocket::stream<Tcp::socket> socket_;
  std::string subprotocol_;
};

/// Takes events until there are so many, or 5 s have passed.
inline std::vector<web::Event> wait_for_events(web::Server& server, std::size_t count) {
  std::vector<web::Event> all;
  const auto end = std::chrono::steady_clock::now() + std::chrono::seconds(5);
  while (all.size() < count && std::chrono::steady_clock::now() < end) {
    for (web::Event& event : server.take_events()) all.push_back(std::move(event));
    std::this_thread::sleep_for(std::chrono::milliseconds(2));
  }
  return all;
}

/// Waits until the condition holds; false after 8 s.
template <class Condition>
bool holds_soon(Condition condition) {
  const auto end = std::chrono::steady_clock::now() + std::chrono::seconds(8);
  while (!condition()) {
    if (std::chrono::steady_clock::now() > end) return false;
    std::this_thread::sleep_for(std::chrono::milliseconds(5));
  }
  return true;
}

}  // namespace understory::test
