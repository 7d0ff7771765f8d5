#include "common/web/server.hpp"

#include <pthread.h>

#include <boost/asio/io_context.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <boost/asio/post.hpp>
#include <boost/asio/steady_timer.hpp>
#include <chrono>
#include <csignal>
#include <list>
#include <thread>
#include <unordered_map>
#include <unordered_set>
#include <utility>

#include "common/web/http_session.hpp"
#include "common/web/shared_state.hpp"
#include "common/web/socket_session.hpp"

namespace understory::web {

namespace asio = boost::asio;
using tcp = asio::ip::tcp;

class Server::Impl {
 public:
  explicit Impl(ServerOptions options)
      : options_(std::move(options)), acceptor_(context_), pause_(context_) {
    listen();
    accept();
    start_thread();
  }
  ~Impl() {
    context_.stop();
    thread_.join();
    sockets_.clear();  // Their timers need the context.
  }
  Impl(const Impl&) = delete;
  Impl& operator=(const Impl&) = delete;

  std::uint16_t port() const { return port_; }
  SharedState& shared() { return *shared_; }

  std::vector<Event> take_events() {
    std::vector<Event> events = shared_->take();
    std::unordered_set<ClientId> spoke;
    for (const Event& event : events) {
      if (event.kind == Event::Kind::kText || event.kind == Event::Kind::kBinary)
        spoke.insert(event.client);
    }
    for (const ClientId client : spoke) {
      with(client, [](SocketSession& session) { session.resume(); });
    }
    return events;
  }

  template <class Action>
  void with(ClientId client, Action action) {
    asio::post(context_, [this, client, action = std::move(action)] {
      const auto found = sockets_.find(client);
      if (found == sockets_.end()) return;
      // The action may end the session and with it the entry.
      const std::shared_ptr<SocketSession> session = found->second;
      action(*session);
    });
  }

 private:
  std::string name() const { return options_.address + ":" + std::to_string(options_.port); }

  void listen() {
    boost::system::error_code error;
    const auto address = asio::ip::make_address(options_.address, error);
    if (error) throw ServerError("web server: " + options_.address + " is no address in numbers");
    if (!address.is_loopback() && !options_.beyond_loopback)
      throw ServerError("web server: " + name() +
                        " can be reached from other computers, which is not allowed");

    const tcp::endpoint endpoint(address, options_.port);
    acceptor_.open(endpoint.protocol(), error);
    if (!error) acceptor_.set_option(asio::socket_base::reuse_address(true), error);
    if (!error) acceptor_.bind(endpoint, error);
    if (!error) acceptor_.listen(asio::socket_base::max_listen_connections, error);
    if (error) throw ServerError("web server: " + name() + ": " + error.message());
    port_ = acceptor_.local_endpoint().port();
  }

  /// Starts the thread; signals go to the other threads.
  void start_thread() {
    sigset_t all;
    sigset_t before;
    sigfillset(&all);
    pthread_sigmask(SIG_SETMASK, &all, &before);
    thread_ = std::thread([this] { context_.run(); });
    pthread_sigmask(SIG_SETMASK, &before, nullptr);
  }

  void accept() {
    acceptor_.async_accept([this](const boost::system::error_code& error, tcp::socket socket) {
      if (error == asio::error::operation_aborted) return;
      if (error) {
        // No file descriptor is left: wait before the next try.
        pause_.expires_after(std::chrono::milliseconds(200));
        pause_.async_wait([this](const boost::system::error_code& /*error*/) { accept(); });
        return;
      }
      take(std::move(socket));
      accept();
    });
  }

  void take(tcp::socket socket) {
    shared_->count(&ServerCounts::connections);
    if (sessions_.size() + sockets_.size() >= options_.most_connections && !make_room()) {
      shared_->count(&ServerCounts::too_many);
      return;
    }
    boost::system::error_code ignored;
    socket.set_option(tcp::no_delay(true), ignored);
    const auto place = sessions_.emplace(sessions_.end());
    const auto session = std::make_shared<HttpSession>(
        std::move(socket), options_, shared_,
        [this](boost::beast::tcp_stream stream, const SocketSession::Request& request,
               const SocketPath& path, std::string subprotocol) {
          open_socket(std::move(stream), request, path, std::move(subprotocol));
        },
        [this, place] { sessions_.erase(place); });
    *place = session;
    session->read();
  }

  /// A slow, incomplete request costs its sender nothing, so it must not exclude others.
  bool make_room() {
    std::shared_ptr<HttpSession> slowest;
    for (const auto& one : sessions_) {
      const auto session = one.lock();
      if (!session || !session->waiting_since()) continue;
      if (!slowest || session->waiting_since() < slowest->waiting_since()) slowest = session;
    }
    if (slowest) slowest->give_way();
    return slowest != nullptr;
  }

  void open_socket(boost::beast::tcp_stream stream, const SocketSession::Request& request,
                   const SocketPath& path, std::string subprotocol) {
    const ClientId id = ++last_client_;
    SocketSession::Place place{id,
                               path,
                               std::move(subprotocol),
                               options_.most_unsent_bytes,
                               options_.socket_timeout_s,
                               shared_,
                               [this](ClientId client) { sockets_.erase(client); }};
    const auto session = std::make_shared<SocketSession>(std::move(stream), std::move(place));
    sockets_[id] = session;
    session->start(request);
  }

  // Sessions change counts and erase themselves when the context destroys them, so members that
  // they use are declared before it.
  ServerOptions options_;
  std::shared_ptr<SharedState> shared_ = std::make_shared<SharedState>();
  std::list<std::weak_ptr<HttpSession>> sessions_;  ///< Connections that are not WebSockets yet.
  ClientId last_client_ = 0;
  std::unordered_map<ClientId, std::shared_ptr<SocketSession>> sockets_;
  std::uint16_t port_ = 0;
  asio::io_context context_{1};
  tcp::acceptor acceptor_;
  asio::steady_timer pause_;
  std::thread thread_;
};

Server::Server(const ServerOptions& options) : impl_(std::make_unique<Impl>(options)) {}
Server::~Server() = default;

std::uint16_t Server::port() const { return impl_->port(); }
int Server::file_descriptor() const { return impl_->shared().file_descriptor(); }

void Server::set_document(const std::string& path, Document document) {
  impl_->shared().set_document(path, std::move(document));
}

std::vector<Event> Server::take_events() { return impl_->take_events(); }

void Server::send_binary(ClientId client, std::shared_ptr<const std::string> message) {
  impl_->with(client, [message = std::move(message)](SocketSession& session) {
    session.send(message, true);
  });
}

void Server::send_text(ClientId client, std::shared_ptr<const std::string> message) {
  impl_->with(client, [message = std::move(message)](SocketSession& session) {
    session.send(message, false);
  });
}

void Server::close(ClientId client, const std::string& reason) {
  impl_->with(client, [reason](SocketSession& session) { session.close(reason); });
}

ServerCounts Server::counts() const { return impl_->shared().counts(); }

}  // namespace understory::web
