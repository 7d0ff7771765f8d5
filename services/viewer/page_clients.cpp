#include "services/viewer/page_clients.hpp"

#include <nlohmann/json.hpp>
#include <stdexcept>

#include "services/viewer/frame_writer.hpp"

namespace understory::viewer {
namespace {

using PageJson = nlohmann::json;

constexpr std::size_t kMostOnTheWay = 2;
/// Without a pose, a frame is sent every this many periods.
constexpr std::int64_t kPeriodsWithoutPose = 3;
constexpr double kLongestToScreen_ms = 60'000.0;

/// Numbers, texts and booleans of a message; a value of another type counts as missing.
std::optional<std::uint64_t> unsigned_in(const PageJson& message, const char* key) {
  const auto found = message.find(key);
  if (found == message.end() || !found->is_number_unsigned()) return std::nullopt;
  return found->get<std::uint64_t>();
}

std::shared_ptr<const std::string> answer(const PageRequests& requests, const PageJson& question) {
  nlohmann::ordered_json header = {{"kind", "story"},
                                   {"request", unsigned_in(question, "request").value_or(0)}};
  try {
    if (!requests.story) throw std::runtime_error("no stories are kept here");
    header["story"] = requests.story(question);
    header["ok"] = true;
  } catch (const std::exception& error) {
    // Also for a question with fields of other types.
    header["ok"] = false;
    header["error"] = error.what();
  }
  return FrameWriter().message(std::move(header));
}

}  // namespace

PageClients::PageClients(std::vector<const Scene*> runs, PageRequests requests,
                         std::int64_t period_us)
    : runs_(std::move(runs)), requests_(std::move(requests)), period_us_(period_us) {}

PageMessage PageClients::opened(web::ClientId client, const nlohmann::ordered_json& hello) {
  Client& one = clients_[client];
  one = {};
  one.cursors.resize(runs_.size());
  return {client, FrameWriter().message(hello)};
}

std::vector<PageMessage> PageClients::take(web::ClientId client, const std::string& text,
                                           std::optional<std::string>& refusal) {
  const auto found = clients_.find(client);
  if (found == clients_.end()) return {};
  const PageJson message = PageJson::parse(text, nullptr, false);
  if (!message.is_object()) {
    refusal = "not a JSON object";
    return {};
  }

  if (message.contains("ack")) {
    acknowledge(found->second, message);
    return {};
  }
  if (message.contains("overlays") && message["overlays"].is_array() &&
      message["overlays"].size() <= 16) {
    found->second.overlays.clear();
    for (const PageJson& overlay : message["overlays"]) {
      if (overlay.is_string()) found->second.overlays.insert(overlay.get<std::string>());
    }
    return {};
  }
  if (message.contains("ask") && message["ask"].is_string())
    return {{client, answer(requests_, message)}};
  if (message.contains("play") || message.contains("seek") || message.contains("revision")) {
    if (requests_.control) requests_.control(message);
    return {};
  }
  refusal = "not a message of the protocol";
  return {};
}

void PageClients::acknowledge(Client& client, const PageJson& message) {
  const auto sequence = unsigned_in(message, "ack");
  if (!sequence) return;
  const auto sent = client.on_the_way.find(*sequence);
  if (sent == client.on_the_way.end()) return;
  const auto shown = message.find("shown_ms");
  if (shown != message.end() && shown->is_number()) {
    const double ms = shown->get<double>() - sent->second;
    if (ms >= 0.0 && ms < kLongestToScreen_ms) to_screen_.add(static_cast<std::int64_t>(1e3 * ms));
  }
  // Frames are shown in order: earlier ones were shown, too.
  client.on_the_way.erase(client.on_the_way.begin(), std::next(sent));
}

std::optional<std::size_t> PageClients::run_with_news(const Client& client) const {
  for (std::size_t i = 0; i < runs_.size(); ++i) {
    const std::size_t run = (client.next_run + i) % runs_.size();
    if (has_news(*runs_[run], client.cursors[run])) return run;
  }
  return std::nullopt;
}

bool PageClients::is_due(const Client& client, std::int64_t now_us) const {
  const std::int64_t since_us = now_us - client.last_us;
  if (since_us < 0 || since_us >= kPeriodsWithoutPose * period_us_) return true;
  if (client.has_more) return since_us >= period_us_ / 2;
  if (since_us < period_us_) return false;
  for (std::size_t run = 0; run < runs_.size(); ++run) {
    if (has_moved(*runs_[run], client.cursors[run])) return true;
  }
  return false;
}

std::vector<PageMessage> PageClients::frames(std::int64_t now_us,
                                             const nlohmann::ordered_json& extra,
                                             std::optional<std::int64_t> wall_us) {
  std::vector<PageMessage> messages;
  for (auto& [id, client] : clients_) {
    if (!is_due(client, now_us)) continue;
    const auto run = run_with_news(client);
    if (!run) continue;
    client.last_us = now_us;
    if (client.on_the_way.size() >= kMostOnTheWay) {
      ++client.skipped;
      ++skipped_;
      continue;
    }

    FrameRequest request;
    request.run = *run;
    request.sequence = ++client.sequence;
    request.skipped = client.skipped;
    request.wall_us = wall_us.value_or(runs_[*run]->newest_wall_us());
    request.overlays = client.overlays;
    messages.push_back({id, make_frame(*runs_[*run], request, extra, client.cursors[*run])});
    client.on_the_way[request.sequence] = 1e-3 * static_cast<double>(request.wall_us);
    client.next_run = *run + 1;
    client.has_more = run_with_news(client).has_value();
  }
  return messages;
}

}  // namespace understory::viewer
