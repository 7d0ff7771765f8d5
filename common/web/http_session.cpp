#include "common/web/http_session.hpp"

#include <algorithm>
#include <boost/beast/websocket.hpp>
#include <chrono>
#include <utility>

#include "common/web/request_checks.hpp"

namespace understory::web {
namespace {

namespace beast = boost::beast;
namespace http = beast::http;

constexpr std::uint32_t kMostHeaderBytes = 8192;
constexpr std::uint64_t kMostBodyBytes = 1024;

std::string_view view(boost::string_view text) { return {text.data(), text.size()}; }

http::response<http::string_body> plain(http::status status, unsigned version, const char* text) {
  http::response<http::string_body> response(status, version);
  response.set(http::field::content_type, "text/plain; charset=utf-8");
  response.body() = text;
  return response;
}

}  // namespace

HttpSession::HttpSession(boost::asio::ip::tcp::socket socket, const ServerOptions& options,
                         std::shared_ptr<SharedState> shared, Upgrade upgrade,
                         std::function<void()> ended)
    : stream_(std::move(socket)),
      options_(options),
      shared_(std::move(shared)),
      upgrade_(std::move(upgrade)),
      ended_(std::move(ended)) {}

HttpSession::~HttpSession() { ended_(); }

void HttpSession::read() {
  parser_.emplace();
  parser_->header_limit(kMostHeaderBytes);
  parser_->body_limit(kMostBodyBytes);
  waiting_ = std::chrono::steady_clock::now();
  stream_.expires_after(std::chrono::seconds(options_.request_timeout_s));
  http::async_read(stream_, buffer_, *parser_,
                   [self = shared_from_this()](const beast::error_code& error,
                                               std::size_t /*bytes*/) { self->on_read(error); });
}

void HttpSession::give_way() {
  shared_->count(&ServerCounts::gave_way);
  waiting_.reset();
  beast::error_code ignored;
  stream_.socket().close(ignored);
}

void HttpSession::on_read(const beast::error_code& error) {
  waiting_.reset();
  if (!error) {
    shared_->count(&ServerCounts::requests);
    answer(parser_->get());
    return;
  }
  if (error == http::error::end_of_stream || error == boost::asio::error::connection_reset ||
      error == boost::asio::error::operation_aborted) {
    return;
  }
  if (error == beast::error::timeout) {
    // A browser keeps idle connections: only an incomplete request counts as slow.
    if (parser_->got_some()) shared_->count(&ServerCounts::too_slow);
  } else if (error == http::error::header_limit || error == http::error::body_limit) {
    shared_->count(&ServerCounts::too_large);
  } else {
    shared_->count(&ServerCounts::malformed);
  }
}

void HttpSession::answer(const SocketSession::Request& request) {
  if (!is_own_host(view(request[http::field::host]), options_.host_names)) {
    shared_->count(&ServerCounts::refused_host);
    send(plain(http::status::forbidden, request.version(),
               "This server is called localhost, or by its address in numbers.\n"));
    return;
  }
  if (beast::websocket::is_upgrade(request)) {
    if (upgrade(request)) return;
    send(plain(http::status::forbidden, request.version(),
               "No WebSocket here for this page or subprotocol.\n"));
    return;
  }
  send(response_to(request));
}

bool HttpSession::upgrade(const SocketSession::Request& request) {
  const std::string_view path = path_of(view(request.target()));
  const auto found = std::ranges::find(options_.sockets, path, &SocketPath::path);
  if (found == options_.sockets.end()) return false;
  if (!is_allowed_origin(view(request[http::field::origin]), view(request[http::field::host]),
                         found->allowed_origins)) {
    shared_->count(&ServerCounts::refused_origin);
    return false;
  }

  std::string subprotocol;
  if (!found->subprotocols.empty()) {
    const auto chosen =
        chosen_subprotocol(view(request[http::field::sec_websocket_protocol]), found->subprotocols);
    if (!chosen) return false;
    subprotocol = *chosen;
  }
  upgrade_(std::move(stream_), parser_->release(), *found, std::move(subprotocol));
  return true;
}

HttpSession::Response HttpSession::response_to(const SocketSession::Request& request) const {
  if (request.method() != http::verb::get && request.method() != http::verb::head)
    return plain(http::status::method_not_allowed, request.version(), "GET and HEAD only.\n");
  const auto document = shared_->document(std::string(path_of(view(request.target()))));
  if (!document) return plain(http::status::not_found, request.version(), "Not found.\n");

  Response response(http::status::ok, request.version());
  response.set(http::field::content_type, document->content_type);
  response.set(http::field::cache_control, "no-cache");
  response.set("X-Content-Type-Options", "nosniff");
  response.set("Content-Security-Policy",
               "default-src 'self'; img-src 'self' data: blob:; frame-ancestors 'none'");
  response.body() = document->body;
  response.keep_alive(request.keep_alive());
  response.prepare_payload();
  if (request.method() == http::verb::head) response.body().clear();
  return response;
}

void HttpSession::send(Response response) {
  auto shared = std::make_shared<Response>(std::move(response));
  if (shared->body().empty() == false || !shared->has_content_length()) shared->prepare_payload();
  http::async_write(
      stream_, *shared,
      [self = shared_from_this(), shared](const beast::error_code& error, std::size_t /*bytes*/) {
        if (error) return;
        if (shared->need_eof()) {
          beast::error_code ignored;
          self->stream_.socket().shutdown(boost::asio::ip::tcp::socket::shutdown_send, ignored);
          return;
        }
        self->read();
      });
}

}  // namespace understory::web
