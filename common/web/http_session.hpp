// One HTTP connection, in the thread of the sockets, until it ends or becomes a WebSocket.
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

/// Keeps itself alive while an operation is under way.
class HttpSession : public std::enable_shared_from_this<HttpSession> {
 public:
  /// Takes over a connection that asks for a WebSocket and may have it.
  using Upgrade =
      std::function<void(boost::beast::tcp_stream stream, const SocketSession::Request& request,
                         const SocketPath& path, std::string subprotocol)>;

  /// `options` must outlive it. `ended` is called once, also where the connection was handed on.
  HttpSession(boost::asio::ip::tcp::socket socket, const ServerOptions& options,
              std::shared_ptr<SharedState> shared, Upgrade upgrade, std::function<void()> ended);
  /// Tells that it is over.
  ~HttpSession();
  HttpSession(const HttpSession&) = delete;
  HttpSession& operator=(const HttpSession&) = delete;

  /// Waits for a request.
  void read();
  /// Since when it waits for a request that is not whole yet; none while one is answered.
  std::optional<std::chrono::steady_clock::time_point> waiting_since() const { return waiting_; }
  /// Ends it: its place is needed.
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
