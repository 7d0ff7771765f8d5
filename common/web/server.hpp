// An HTTP server with WebSockets for programs that have a loop of their own.
//
// One thread reads and writes all sockets. What clients say waits as events for the owner, who
// takes them when file_descriptor() is readable; what the owner sends waits for the sockets. So a
// client, however slow or hostile, never holds up the owner, and the owner never a client.
#pragma once

#include <cstdint>
#include <memory>
#include <stdexcept>
#include <string>
#include <vector>

namespace understory::web {

/// One client of a WebSocket; never used again.
using ClientId = std::uint64_t;

/// The server could not be started; what() names address and port.
class ServerError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// What a GET of a path gives.
struct Document {
  std::string content_type;
  std::string body;
};

/// A path on which clients may open a WebSocket.
struct SocketPath {
  std::string path;
  /// In order of preference; the first that the client offers is taken. Empty: none is asked for;
  /// else a client that offers none of them is refused.
  std::vector<std::string> subprotocols;
  /// Pages of other servers that may connect, as browsers name them (https://app.example.org);
  /// the server's own may always.
  std::vector<std::string> allowed_origins;
  std::size_t most_message_bytes = 4096;  ///< A larger message closes the connection.
};

/// Where the server listens and what it allows.
struct ServerOptions {
  std::string address = "127.0.0.1";
  std::uint16_t port = 0;  ///< 0: any free one; see Server::port().
  /// Without it an address that is not of the loopback interface is refused.
  bool beyond_loopback = false;
  /// Names by which the server may be called, beside localhost and numbers: a page of elsewhere
  /// whose name is made to lead here is not answered.
  std::vector<std::string> host_names;
  std::vector<SocketPath> sockets;
  /// When there are so many, the one that waits longest for a whole request gives way to a new one;
  /// where none waits, the new one is refused.
  std::size_t most_connections = 64;
  /// A client that has not taken so many bytes is closed.
  std::size_t most_unsent_bytes = std::size_t{32} << 20U;
  int request_timeout_s = 10;  ///< For a whole request, and between two of one connection.
  int socket_timeout_s = 60;   ///< A WebSocket that does not answer a ping so long is closed.
};

/// Something that a client did.
struct Event {
  /// What it did.
  enum class Kind : std::uint8_t {
    kOpened,  ///< A WebSocket is open.
    kText,
    kBinary,
    kSent,   ///< All that was sent to it is with the operating system.
    kClosed  ///< The last event of this client.
  };
  Kind kind = Kind::kClosed;
  ClientId client = 0;
  std::string path;         ///< kOpened: of the SocketPath.
  std::string subprotocol;  ///< kOpened: the one agreed upon.
  std::string data;         ///< kText (UTF-8, checked) and kBinary.
};

/// Counted since the start.
struct ServerCounts {
  std::uint64_t connections = 0;
  std::uint64_t requests = 0;        ///< Answered, whatever the answer.
  std::uint64_t sockets = 0;         ///< WebSockets that were opened.
  std::uint64_t refused_host = 0;    ///< A name that is not this server's.
  std::uint64_t refused_origin = 0;  ///< A page of elsewhere.
  std::uint64_t malformed = 0;       ///< Not HTTP, or not WebSocket.
  std::uint64_t too_large = 0;       ///< Headers, bodies or messages.
  std::uint64_t too_slow = 0;        ///< Requests that were not whole in time.
  std::uint64_t too_many = 0;        ///< Connections above the limit.
  std::uint64_t gave_way = 0;  ///< Closed for a newer one: waited longest for a whole request.
  std::uint64_t overrun = 0;   ///< Closed: they did not take what was sent.
  bool operator==(const ServerCounts&) const = default;

  /// Sum of what was refused.
  std::uint64_t refused() const {
    return refused_host + refused_origin + malformed + too_large + too_slow + too_many + gave_way +
           overrun;
  }
};

/// See the head of the file. All functions may be called from any thread.
class Server {
 public:
  /// Listens at once. Throws ServerError.
  explicit Server(const ServerOptions& options);
  /// Closes everything.
  ~Server();
  Server(const Server&) = delete;
  Server& operator=(const Server&) = delete;

  /// The port that it listens on.
  std::uint16_t port() const;
  /// Readable when there are events.
  int file_descriptor() const;

  /// What GET of `path` gives from now on.
  void set_document(const std::string& path, Document document);
  /// The events that wait, in the order in which they happened. A client with 32 messages that
  /// wait is not read from until they are taken.
  std::vector<Event> take_events();
  /// Sends a message to a client; one that is closed already is passed over.
  void send_binary(ClientId client, std::shared_ptr<const std::string> message);
  /// The same as text.
  void send_text(ClientId client, std::shared_ptr<const std::string> message);
  /// Closes a client; `reason` (at most 120 bytes) is told to it.
  void close(ClientId client, const std::string& reason);
  /// As of now.
  ServerCounts counts() const;

 private:
  class Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace understory::web
