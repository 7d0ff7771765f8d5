// Foxglove, Lichtblick and others of their protocol, beside the pages.
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

/// Sessions and the converter that feeds them. A client gets its next messages when it has taken
/// those before; what it is too slow for its session drops and counts.
class FoxgloveClients {
 public:
  /// For the server: the path and its subprotocols.
  static web::SocketPath socket_path(std::vector<std::string> allowed_origins);

  /// Whether a message of this channel is of any use now: what a client that comes later needs is
  /// always heard, the rest where there is a client.
  bool wants(std::string_view channel) const;
  /// Takes a message.
  void hear(std::string_view channel, std::span<const std::uint8_t> bytes, std::int64_t wall_us);

  /// Takes what happened to a client. A text: it is to be closed with that reason.
  std::optional<std::string> take(const web::Event& event);
  /// A message for a client.
  struct Message {
    web::ClientId client = 0;
    foxglove::Outgoing outgoing;
  };
  /// What is to be sent now.
  std::vector<Message> due();

  /// Whether this client is one of them.
  bool has(web::ClientId client) const { return clients_.contains(client); }
  /// Clients that look.
  std::size_t size() const { return clients_.size(); }
  /// Messages that clients were too slow for, so far, of those that are there.
  std::uint64_t dropped() const;

 private:
  struct Client {
    foxglove::Session session;
    bool is_busy = false;  ///< Sent messages are not with the operating system yet.
  };
  std::map<web::ClientId, Client> clients_;
  foxglove::Converter converter_;
};

}  // namespace understory::viewer
