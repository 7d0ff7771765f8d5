// The web server and what goes through it: our pages, and viewers of others.
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

/// Where the page is served.
struct PageParameters {
  std::string address = "127.0.0.1";  ///< To listen on.
  int port = 7680;                    ///< Or one of the nine above it. 0: any free one.
  bool beyond_loopback = false;       ///< Other computers may connect.
  std::string host_names;             ///< Comma-separated names of this computer.
  std::string foxglove_origins = "https://app.foxglove.dev";  ///< Comma-separated.
  double rate_hz = 20.0;                                      ///< Frames for one page, at most.
  int most_clients = 32;                                      ///< Connections.
};

/// Owns the server; attend() does what is due. One thread calls it.
class PageHost {
 public:
  /// Throws web::ServerError. `runs` must outlive it.
  PageHost(const PageParameters& parameters, std::vector<const Scene*> runs, PageRequests requests,
           nlohmann::ordered_json hello);

  /// Readable when there is something to take in.
  int file_descriptor() const { return server_->file_descriptor(); }
  /// Takes what pages said and sends what is due; see PageClients::frames().
  void attend(std::int64_t now_us, const nlohmann::ordered_json& extra = {},
              std::optional<std::int64_t> wall_us = std::nullopt);
  /// For viewers of others: what the run hears.
  FoxgloveClients& foxglove() { return foxglove_; }
  /// Where the page is.
  std::string url() const;
  /// Counts of the server.
  web::ServerCounts counts() const { return server_->counts(); }
  /// Pages that look, and what they miss.
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
  std::int64_t told_us_ = -1'000'000;  ///< When /health.json was made.
};

}  // namespace understory::viewer
