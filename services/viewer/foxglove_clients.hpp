// Clients with the Foxglove protocol (Foxglove, Lichtblick and others), beside the pages.
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "common/foxglove/session.hpp"
#include "common/web/server.hpp"

namespace understory::viewer {

/// Sessions and their converter. A client gets its next messages when it has received those before;
/// its session drops and counts messages for which it is too slow.
class FoxgloveClients {
 public:
  /// For the server: the path and its subprotocols.
  static web::SocketPath socket_path(std::vector<std::string> allowed_origins);

  /// Whether a message of this channel is needed now: channels needed by later clients are always
  /// received, others only if there is a client.
  bool wants(std::string_view channel) const;
  /// Adds a message.
  void hear(std::string_view channel, std::span<const std::uint8_t> bytes, std::int64_t wall_us);

  /// Handles an event of a client. A text: close the client with that reason.
  std::optional<std::string> take(const web::Event& event);
  /// A message for a client.
  struct Message {
    web::ClientId client = 0;
    foxglove::Outgoing outgoing;
  };
  /// The messages to send now.
  std::vector<Message> due();

  /// Whether this client uses the Foxglove protocol.
  bool has(web::ClientId client) const { return clients_.contains(client); }
  /// Number of clients.
  std::size_t size() const { return clients_.size(); }
  /// Number of messages dropped for slow clients, over the present clients.
  std::uint64_t dropped() const;

 private:
  struct Client {
    foxglove::Session session;
    bool is_busy = false;  ///< The operating system has not taken all sent messages yet.
  };
  std::map<web::ClientId, Client> clients_;
  foxglove::Converter converter_;
};

}  // namespace understory::viewer
