#include "services/viewer/foxglove_clients.hpp"

#include <algorithm>
#include <array>

namespace understory::viewer {
namespace {

constexpr std::size_t kMostTogether = 64;  ///< Messages.
constexpr std::size_t kMostBytes = std::size_t{4} << 20U;

/// Channels whose state a later client needs.
constexpr std::array<std::string_view, 8> kStateChannels = {
    "MAP",         "MAP_DELTA",    "EXISTENCE",      "SUBMAP", "MAP_CORRECTION",
    "LOOP_RESULT", "LOOP_CLOSURE", "TRUTH_LANDMARKS"};

std::span<const std::uint8_t> bytes_of(const std::string& text) {
  return {reinterpret_cast<const std::uint8_t*>(text.data()), text.size()};
}

}  // namespace

web::SocketPath FoxgloveClients::socket_path(std::vector<std::string> allowed_origins) {
  return {.path = "/foxglove",
          .subprotocols = {foxglove::kSubprotocols.begin(), foxglove::kSubprotocols.end()},
          .allowed_origins = std::move(allowed_origins),
          .most_message_bytes = foxglove::SessionOptions{}.most_text_bytes};
}

bool FoxgloveClients::wants(std::string_view channel) const {
  if (!foxglove::Converter::takes(channel)) return false;
  return !clients_.empty() || std::ranges::find(kStateChannels, channel) != kStateChannels.end();
}

void FoxgloveClients::hear(std::string_view channel, std::span<const std::uint8_t> bytes,
                           std::int64_t wall_us) {
  for (const foxglove::Converted& message : converter_.take(channel, bytes, wall_us)) {
    for (auto& [id, client] : clients_) client.session.offer(message);
  }
}

std::optional<std::string> FoxgloveClients::take(const web::Event& event) {
  if (event.kind == web::Event::Kind::kOpened) {
    clients_.try_emplace(event.client);
    return std::nullopt;
  }
  const auto found = clients_.find(event.client);
  if (found == clients_.end()) return std::nullopt;
  Client& client = found->second;
  switch (event.kind) {
    case web::Event::Kind::kText:
      client.session.take_text(event.data);
      break;
    case web::Event::Kind::kBinary:
      client.session.take_binary(bytes_of(event.data));
      break;
    case web::Event::Kind::kSent:
      client.is_busy = false;
      break;
    case web::Event::Kind::kClosed:
      clients_.erase(found);
      return std::nullopt;
    case web::Event::Kind::kOpened:
      break;
  }

  foxglove::bring_up_to_date(client.session, converter_);
  if (client.session.should_close()) return "too much that is not of the protocol";
  return std::nullopt;
}

std::vector<FoxgloveClients::Message> FoxgloveClients::due() {
  std::vector<Message> messages;
  for (auto& [id, client] : clients_) {
    if (client.is_busy) continue;
    foxglove::bring_up_to_date(client.session, converter_);
    std::size_t bytes = 0;
    for (std::size_t i = 0; i < kMostTogether && bytes < kMostBytes; ++i) {
      auto next = client.session.next();
      if (!next) break;
      bytes += next->bytes.size();
      messages.push_back({id, *std::move(next)});
      client.is_busy = true;
    }
  }
  return messages;
}

std::uint64_t FoxgloveClients::dropped() const {
  std::uint64_t sum = 0;
  for (const auto& [id, client] : clients_) sum += client.session.counts().dropped;
  return sum;
}

}  // namespace understory::viewer
