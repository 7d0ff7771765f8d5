#include "common/web/socket_session.hpp"

#include <chrono>
#include <utility>

namespace understory::web {
namespace {

namespace beast = boost::beast;
namespace websocket = beast::websocket;

constexpr std::size_t kMostWaiting = 32;

websocket::stream_base::timeout timeouts(int seconds) {
  return {.handshake_timeout = std::chrono::seconds(10),
          .idle_timeout = std::chrono::seconds(seconds),
          .keep_alive_pings = true};
}

}  // namespace

SocketSession::SocketSession(beast::tcp_stream stream, Place place)
    : socket_(std::move(stream)), place_(std::move(place)) {}

void SocketSession::start(const Request& request) {
  // The WebSocket has timers of its own.
  socket_.next_layer().expires_never();
  socket_.set_option(timeouts(place_.timeout_s));
  socket_.read_message_max(place_.path.most_message_bytes);
  if (!place_.subprotocol.empty()) {
    socket_.set_option(websocket::stream_base::decorator(
        [protocol = place_.subprotocol](websocket::response_type& response) {
          response.set(beast::http::field::sec_websocket_protocol, protocol);
        }));
  }

  socket_.async_accept(request, [self = shared_from_this()](const beast::error_code& error) {
    if (error) {
      self->count_failure(error);
      self->end();
      return;
    }
    self->is_open_ = true;
    self->place_.shared->count(&ServerCounts::sockets);
    self->place_.shared->push({Event::Kind::kOpened,
                               self->place_.id,
                               self->place_.path.path,
                               self->place_.subprotocol,
                               {}});
    self->write();
    self->read();
  });
}

void SocketSession::read() {
  if (is_reading_ || is_over_ || waiting_messages_ >= kMostWaiting) return;
  is_reading_ = true;
  socket_.async_read(
      buffer_, [self = shared_from_this()](const beast::error_code& error, std::size_t /*bytes*/) {
        self->is_reading_ = false;
        self->on_read(error);
      });
}

void SocketSession::on_read(const beast::error_code& error) {
  if (error) {
    count_failure(error);
    end();
    return;
  }
  ++waiting_messages_;
  place_.shared->push({socket_.got_text() ? Event::Kind::kText : Event::Kind::kBinary,
                       place_.id,
                       {},
                       {},
                       beast::buffers_to_string(buffer_.data())});
  buffer_.consume(buffer_.size());
  read();
}

void SocketSession::resume() {
  waiting_messages_ = 0;
  if (is_open_) read();
}

void SocketSession::send(std::shared_ptr<const std::string> message, bool is_binary) {
  if (is_over_ || is_closing_) return;
  unsent_bytes_ += message->size();
  if (unsent_bytes_ > place_.most_unsent_bytes) {
    place_.shared->count(&ServerCounts::overrun);
    end();
    return;
  }
  outbox_.push_back({std::move(message), is_binary});
  write();
}

void SocketSession::write() {
  if (is_writing_ || !is_open_ || is_over_) return;
  if (is_closing_) {
    say_goodbye();
    return;
  }
  if (outbox_.empty()) return;
  is_writing_ = true;
  Outgoing first = std::move(outbox_.front());
  outbox_.pop_front();
  socket_.binary(first.is_binary);
  const auto buffer = boost::asio::buffer(*first.bytes);
  // The handler keeps the bytes: the session may be over before they are written.
  socket_.async_write(buffer, [self = shared_from_this(), bytes = std::move(first.bytes)](
                                  const beast::error_code& error, std::size_t /*written*/) {
    self->is_writing_ = false;
    self->unsent_bytes_ -= bytes->size();
    self->on_written(error);
  });
}

void SocketSession::on_written(const beast::error_code& error) {
  if (is_over_) return;
  if (error) {
    end();
    return;
  }
  if (outbox_.empty()) place_.shared->push({Event::Kind::kSent, place_.id, {}, {}, {}});
  write();
}

void SocketSession::close(const std::string& reason) {
  if (is_over_ || is_closing_) return;
  is_closing_ = true;
  goodbye_ = reason.substr(0, 120);
  if (!is_open_) {
    end();
  } else {
    write();  // After the message being written, if there is one.
  }
}

void SocketSession::say_goodbye() {
  is_writing_ = true;
  websocket::close_reason words(websocket::close_code::policy_error);
  words.reason = goodbye_;
  socket_.async_close(
      words, [self = shared_from_this()](const beast::error_code& /*error*/) { self->end(); });
}

void SocketSession::count_failure(const beast::error_code& error) {
  if (error == websocket::error::closed || error == boost::asio::error::eof ||
      error == boost::asio::error::operation_aborted ||
      error == boost::asio::error::connection_reset)
    return;
  if (error == beast::error::timeout) {
    place_.shared->count(&ServerCounts::too_slow);
  } else if (error == websocket::error::message_too_big ||
             error == websocket::error::buffer_overflow) {
    place_.shared->count(&ServerCounts::too_large);
  } else {
    place_.shared->count(&ServerCounts::malformed);
  }
}

void SocketSession::end() {
  if (is_over_) return;
  is_over_ = true;
  outbox_.clear();
  beast::error_code ignored;
  beast::get_lowest_layer(socket_).socket().close(ignored);
  if (is_open_) place_.shared->push({Event::Kind::kClosed, place_.id, {}, {}, {}});
  place_.forget(place_.id);
}

}  // namespace understory::web
