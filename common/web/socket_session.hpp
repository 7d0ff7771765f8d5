// One WebSocket, in the sockets' thread.
#pragma once

#include <boost/asio/ip/tcp.hpp>
#include <boost/beast/core.hpp>
#include <boost/beast/http.hpp>
#include <boost/beast/websocket.hpp>
#include <deque>
#include <functional>
#include <memory>
#include <string>

#include "common/web/shared_state.hpp"

namespace understory::web {

/// Keeps itself alive during an operation.
class SocketSession : public std::enable_shared_from_this<SocketSession> {
 public:
  /// The request for the WebSocket.
  using Request = boost::beast::http::request<boost::beast::http::string_body>;
  /// The server's data for a session.
  struct Place {
    ClientId id = 0;
    SocketPath path;
    std::string subprotocol;
    std::size_t most_unsent_bytes = 0;
    int timeout_s = 0;
    std::shared_ptr<SharedState> shared;
    std::function<void(ClientId)> forget;  ///< Called once at its end.
  };

  /// Takes over a connection.
  SocketSession(boost::beast::tcp_stream stream, Place place);

  /// Answers the request; messages arrive from then on.
  void start(const Request& request);
  /// Queues a message.
  void send(std::shared_ptr<const std::string> message, bool is_binary);
  /// Closes the WebSocket with a reason.
  void close(const std::string& reason);
  /// Call it when the owner has taken the waiting messages.
  void resume();

 private:
  struct Outgoing {
    std::shared_ptr<const std::string> bytes;
    bool is_binary = false;
  };
  void read();
  void on_read(const boost::beast::error_code& error);
  void write();
  void say_goodbye();
  void on_written(const boost::beast::error_code& error);
  void count_failure(const boost::beast::error_code& error);
  void end();

  boost::beast::websocket::stream<boost::beast::tcp_stream> socket_;
  Place place_;
  boost::beast::flat_buffer buffer_;
  std::deque<Outgoing> outbox_;
  std::string goodbye_;
  std::size_t unsent_bytes_ = 0;
  std::size_t waiting_messages_ = 0;  ///< Messages waiting for the owner.
  bool is_reading_ = false;
  bool is_writing_ = false;
  bool is_open_ = false;
  bool is_closing_ = false;
  bool is_over_ = false;
};

}  // namespace understory::web
