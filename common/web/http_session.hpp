// One HTTP connection in the sockets' thread, until it ends or becomes a WebSocket.
#pragma once

#include <boost/asio/ip/tcp.hpp>
#include <boost/beast/core.hpp>
#include <boost/beast/http.hpp>
#include <chrono>
#include <functional>
#include <memory>
#include <optional>

#include "common/web/server.hpp"
#include "common/web/shared_state.hpp"
#include "common/web/socket_session.hpp"

namespace understory::web {

/// Keeps itself alive during an operation.
class HttpSession : public std::enable_shared_from_this<HttpSession> {
 public:
  /// Takes over a connection with an accepted request for a WebSocket.
  using Upgrade =
      std::function<void(boost::beast::tcp_stream stream, const SocketSession::Request& request,
                         const SocketPath& path, std::string subprotocol)>;

  /// `options` must outlive it. `ended` is called once, also if the connection was handed over.
  HttpSession(boost::asio::ip::tcp::socket socket, const ServerOptions& options,
              std::shared_ptr<SharedState> shared, Upgrade upgrade, std::function<void()> ended);
  /// Calls `ended`.
  ~HttpSession();
  HttpSession(const HttpSession&) = delete;
  HttpSession& operator=(const HttpSession&) = delete;

  /// Starts to read a request.
  void read();
  /// Start of the wait for a complete request; none while one is answered.
  std::optional<std::chrono::steady_clock::time_point> waiting_since() const { return waiting_; }
  /// Ends it, because its place is needed.
  void give_way();

 private:
  using Response = boost::beast::http::response<boost::beast::http::string_body>;
  void on_read(const boost::beast::error_code& error);
  void answer(const SocketSession::Request& request);
  bool upgrade(const SocketSession::Request& request);
  Response response_to(const SocketSession::Request& request) const;
  void send(Response response);

  boost::beast::tcp_stream stream_;
  const ServerOptions& options_;
  std::shared_ptr<SharedState> shared_;
  Upgrade upgrade_;
  std::function<void()> ended_;
  std::optional<std::chrono::steady_clock::time_point> waiting_;
  boost::beast::flat_buffer buffer_;
  std::optional<boost::beast::http::request_parser<boost::beast::http::string_body>> parser_;
};

}  // namespace understory::web
