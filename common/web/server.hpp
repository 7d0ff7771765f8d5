// An HTTP server with WebSockets for programs that have a loop of their own.
//
// One thread reads and writes all sockets. Messages of clients wait as events until the owner takes
// them when file_descriptor() is readable; the owner's messages wait for the sockets. So no client,
// however slow or hostile, blocks the owner, and the owner blocks no client.
#pragma once

#include <cstdint>
#include <memory>
#include <stdexcept>
#include <string>
#include <vector>

namespace understory::web {

/// Id of a WebSocket's client; never reused.
using ClientId = std::uint64_t;

/// The server could not be started; what() states address and port.
class ServerError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// Response to a GET of a path.
struct Document {
  std::string content_type;
  std::string body;
};

/// A path on which clients may open a WebSocket.
struct SocketPath {
  std::string path;
  /// In order of preference; the first one offered by the client is used. Empty: none is required;
  /// otherwise a client without any of them is refused.
  std::vector<std::string> subprotocols;
  /// Origins of other servers' pages that may connect (https://app.example.org); the server's own
  /// pages always may.
  std::vector<std::string> allowed_origins;
  std::size_t most_message_bytes = 4096;  ///< A larger message closes the connection.
};

/// Address, port and limits of the server.
struct ServerOptions {
  std::string address = "127.0.0.1";
  std::uint16_t port = 0;  ///< 0 = any free port; see Server::port().
  /// If false, an address outside the loopback interface is refused.
  bool beyond_loopback = false;
  /// Accepted host names beside localhost and numbers: other names that are redirected here are not
  /// answered.
  std::vector<std::string> host_names;
  std::vector<SocketPath> sockets;
  /// At this number, a new connection replaces the one that waits longest for a complete request;
  /// if none waits, the new one is refused.
  std::size_t most_connections = 64;
  /// A client with this many unsent bytes is closed.
  std::size_t most_unsent_bytes = std::size_t{32} << 20U;
  /// Limit for a complete request, and between two requests of one connection.
  int request_timeout_s = 10;
  int socket_timeout_s = 60;  ///< A WebSocket without an answer to a ping for this time is closed.
};

/// An event of a client.
struct Event {
  /// Kind of the event.
  enum class Kind : std::uint8_t {
    kOpened,  ///< A WebSocket is open.
    kText,
    kBinary,
    kSent,   ///< All messages to it were passed to the operating system.
    kClosed  ///< The last event of this client.
  };
  Kind kind = Kind::kClosed;
  ClientId client = 0;
  std::string path;         ///< kOpened: path of the SocketPath.
  std::string subprotocol;  ///< kOpened: the negotiated subprotocol.
  std::string data;         ///< Data of kText (checked UTF-8) and kBinary.
};

/// Counts since the start.
struct ServerCounts {
  std::uint64_t connections = 0;
  std::uint64_t requests = 0;        ///< Answered requests, with any status.
  std::uint64_t sockets = 0;         ///< Opened WebSockets.
  std::uint64_t refused_host = 0;    ///< Refused host names.
  std::uint64_t refused_origin = 0;  ///< Refused origins.
  std::uint64_t malformed = 0;       ///< Not HTTP, or not WebSocket.
  std::uint64_t too_large = 0;       ///< Too large headers, bodies or messages.
  std::uint64_t too_slow = 0;        ///< Requests incomplete after the time limit.
  std::uint64_t too_many = 0;        ///< Connections above the limit.
  std::uint64_t gave_way = 0;        ///< Connections replaced by newer ones.
  std::uint64_t overrun = 0;         ///< Clients closed because of too many unsent bytes.
  bool operator==(const ServerCounts&) const = default;

  /// Sum of all refusals.
  std::uint64_t refused() const {
    return refused_host + refused_origin + malformed + too_large + too_slow + too_many + gave_way +
           overrun;
  }
};

/// See the comment at the top of the file. All functions may be called from any thread.
class Server {
 public:
  /// Starts to listen. Throws ServerError.
  explicit Server(const ServerOptions& options);
  /// Closes everything.
  ~Server();
  Server(const Server&) = delete;
  Server& operator=(const Server&) = delete;

  /// The port of the server.
  std::uint16_t port() const;
  /// Readable when there are events.
  int file_descriptor() const;

  /// Sets the response to GET of `path` from now on.
  void set_document(const std::string& path, Document document);
  /// Takes the waiting events in order. A client with 32 waiting messages is not read until they
  /// are taken.
  std::vector<Event> take_events();
  /// Sends a message to a client; a closed client is ignored.
  void send_binary(ClientId client, std::shared_ptr<const std::string> message);
  /// The same as text.
  void send_text(ClientId client, std::shared_ptr<const std::string> message);
  /// Closes a client; `reason` (at most 120 bytes) is sent to it.
  void close(ClientId client, const std::string& reason);
  /// The present counts.
  ServerCounts counts() const;

 private:
  class Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace understory::web
