#include "services/viewer/page_host.hpp"

#include <sstream>

#include "services/viewer/page_bundle.hpp"

namespace understory::viewer {
namespace {

constexpr const char* kPagePath = "/live";
constexpr int kPorts = 10;
constexpr std::int64_t kTellEvery_us = 500'000;

std::vector<std::string> parts_of(const std::string& list) {
  std::vector<std::string> parts;
  std::istringstream stream(list);
  for (std::string part; std::getline(stream, part, ',');) {
    const auto first = part.find_first_not_of(' ');
    if (first == std::string::npos) continue;
    parts.push_back(part.substr(first, part.find_last_not_of(' ') - first + 1));
  }
  return parts;
}

web::ServerOptions server_options(const PageParameters& parameters) {
  web::ServerOptions options;
  options.address = parameters.address;
  options.port = static_cast<std::uint16_t>(parameters.port);
  options.beyond_loopback = parameters.beyond_loopback;
  options.host_names = parts_of(parameters.host_names);
  options.most_connections = static_cast<std::size_t>(parameters.most_clients);
  options.sockets = {{.path = kPagePath, .subprotocols = {}, .allowed_origins = {}},
                     FoxgloveClients::socket_path(parts_of(parameters.foxglove_origins))};
  return options;
}

nlohmann::ordered_json counts_json(const web::ServerCounts& counts) {
  return {{"connections", counts.connections},
          {"requests", counts.requests},
          {"sockets", counts.sockets},
          {"refused_host", counts.refused_host},
          {"refused_origin", counts.refused_origin},
          {"malformed", counts.malformed},
          {"too_large", counts.too_large},
          {"too_slow", counts.too_slow},
          {"too_many", counts.too_many},
          {"gave_way", counts.gave_way},
          {"overrun", counts.overrun}};
}

/// If another run on this computer uses the port, the next ones are tried.
std::unique_ptr<web::Server> make_server(const PageParameters& parameters) {
  web::ServerOptions options = server_options(parameters);
  for (int tries_left = parameters.port == 0 ? 1 : kPorts;; --tries_left, ++options.port) {
    try {
      return std::make_unique<web::Server>(options);
    } catch (const web::ServerError&) {
      if (tries_left == 1 || options.port == 65535) throw;
    }
  }
}

}  // namespace

PageHost::PageHost(const PageParameters& parameters, std::vector<const Scene*> runs,
                   PageRequests requests, nlohmann::ordered_json hello)
    : parameters_(parameters),
      hello_(std::move(hello)),
      pages_(std::move(runs), std::move(requests),
             static_cast<std::int64_t>(1e6 / parameters.rate_hz)),
      server_(make_server(parameters)) {
  hello_["kind"] = "hello";
  for (const PageFile& file : page_files())
    server_->set_document(file.path, {file.content_type, std::string(file.content)});
}

std::string PageHost::url() const {
  return "http://" + parameters_.address + ":" + std::to_string(server_->port()) + "/";
}

void PageHost::attend(std::int64_t now_us, const nlohmann::ordered_json& extra,
                      std::optional<std::int64_t> wall_us) {
  take_events();
  if (now_us - told_us_ >= kTellEvery_us) tell_counts(now_us);
  for (FoxgloveClients::Message& message : foxglove_.due()) {
    auto bytes = std::make_shared<const std::string>(std::move(message.outgoing.bytes));
    if (message.outgoing.is_binary) {
      server_->send_binary(message.client, std::move(bytes));
    } else {
      server_->send_text(message.client, std::move(bytes));
    }
  }
  if (pages_.size() == 0) return;
  nlohmann::ordered_json header = extra;
  header["numbers"] = figures();
  for (PageMessage& message : pages_.frames(now_us, header, wall_us))
    server_->send_binary(message.client, std::move(message.bytes));
}

nlohmann::ordered_json PageHost::figures() const {
  const bus::LatencyHistogram& to_screen = pages_.to_screen();
  nlohmann::ordered_json figures = {{"clients", pages_.size()},
                                    {"skipped_by_all", pages_.skipped()},
                                    {"refused", server_->counts().refused()}};
  if (to_screen.count() > 0) {
    figures["page_ms"] = 1e-3 * static_cast<double>(to_screen.quantile(0.5));
    figures["page_p99_ms"] = 1e-3 * static_cast<double>(to_screen.quantile(0.99));
  }
  return figures;
}

void PageHost::take_events() {
  const std::vector<web::Event> events = server_->take_events();
  for (const web::Event& event : events) {
    const bool is_page = event.kind == web::Event::Kind::kOpened ? event.path == kPagePath
                                                                 : !foxglove_.has(event.client);
    if (is_page) {
      take_page_event(event);
    } else if (const auto refusal = foxglove_.take(event)) {
      server_->close(event.client, *refusal);
    }
  }
}

void PageHost::take_page_event(const web::Event& event) {
  switch (event.kind) {
    case web::Event::Kind::kOpened: {
      PageMessage hello = pages_.opened(event.client, hello_);
      server_->send_binary(hello.client, std::move(hello.bytes));
      break;
    }
    case web::Event::Kind::kText: {
      std::optional<std::string> refusal;
      for (PageMessage& answer : pages_.take(event.client, event.data, refusal))
        server_->send_binary(answer.client, std::move(answer.bytes));
      if (refusal) server_->close(event.client, *refusal);
      break;
    }
    case web::Event::Kind::kBinary:
      server_->close(event.client, "not a message of the protocol");
      break;
    case web::Event::Kind::kClosed:
      pages_.closed(event.client);
      break;
    case web::Event::Kind::kSent:
      break;
  }
}

void PageHost::tell_counts(std::int64_t now_us) {
  told_us_ = now_us;
  nlohmann::ordered_json body = counts_json(server_->counts());
  body["pages"] = pages_.size();
  body["skipped"] = pages_.skipped();
  body["foxglove_clients"] = foxglove_.size();
  body["foxglove_dropped"] = foxglove_.dropped();
  server_->set_document("/health.json", {"application/json", body.dump(2) + "\n"});
}

}  // namespace understory::viewer
