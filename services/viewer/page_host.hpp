// The web server for the pages and for Foxglove clients.
#pragma once

#include <map>
#include <memory>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "common/web/server.hpp"
#include "services/viewer/foxglove_clients.hpp"
#include "services/viewer/page_clients.hpp"

namespace understory::viewer {

/// Address and limits of the page.
struct PageParameters {
  std::string address = "127.0.0.1";  ///< To listen on.
  int port = 7680;                    ///< Or one of the nine above it. 0: any free one.
  bool beyond_loopback = false;       ///< Other computers may connect.
  std::string host_names;             ///< Comma-separated names of this computer.
  std::string foxglove_origins = "https://app.foxglove.dev";  ///< Comma-separated.
  double rate_hz = 20.0;                                      ///< Frames per page, at most.
  int most_clients = 32;                                      ///< Connections.
};

/// Owns the server; attend() handles everything due. Call it from one thread.
class PageHost {
 public:
  /// Throws web::ServerError. `runs` must outlive it.
  PageHost(const PageParameters& parameters, std::vector<const Scene*> runs, PageRequests requests,
           nlohmann::ordered_json hello);

  /// Readable when there is input.
  int file_descriptor() const { return server_->file_descriptor(); }
  /// Handles messages of pages and sends due frames; see PageClients::frames().
  void attend(std::int64_t now_us, const nlohmann::ordered_json& extra = {},
              std::optional<std::int64_t> wall_us = std::nullopt);
  /// The Foxglove clients: give them the run's messages.
  FoxgloveClients& foxglove() { return foxglove_; }
  /// Address of the page.
  std::string url() const;
  /// Counts of the server.
  web::ServerCounts counts() const { return server_->counts(); }
  /// The open pages, and their missed frames.
  const PageClients& pages() const { return pages_; }

 private:
  void take_events();
  void take_page_event(const web::Event& event);
  void tell_counts(std::int64_t now_us);
  nlohmann::ordered_json figures() const;

  PageParameters parameters_;
  nlohmann::ordered_json hello_;
  PageClients pages_;
  FoxgloveClients foxglove_;
  std::unique_ptr<web::Server> server_;
  std::int64_t told_us_ = -1'000'000;  ///< Time of the last /health.json.
};

}  // namespace understory::viewer
