// The browsers that look at the viewer: who gets which frame when, and what they ask.
#pragma once

#include <functional>
#include <map>
#include <memory>
#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "common/bus/latency_histogram.hpp"
#include "common/web/server.hpp"
#include "services/viewer/scene_frame.hpp"

namespace understory::viewer {

/// What pages may want beside frames; each returns a refusal's text, or none.
struct PageRequests {
  /// Answers a question with the object `story`. Throws std::runtime_error with why there is none.
  std::function<nlohmann::ordered_json(const nlohmann::json& question)> story;
  /// Play, pause, seek, choose a revision.
  std::function<void(const nlohmann::json& control)> control;
};

/// A message for a client.
struct PageMessage {
  web::ClientId client = 0;
  std::shared_ptr<const std::string> bytes;
};

/// Flow control of all pages (protocol.md): two frames on their way at most, and the next one has
/// what changed since. Poses set the pace: what else changed goes along with the next one, or after
/// three periods, since each picture costs the browser the whole window. Pure: the caller has the
/// sockets and the clock.
class PageClients {
 public:
  /// `runs` must outlive it. `period_us`: least time between two frames of a client.
  PageClients(std::vector<const Scene*> runs, PageRequests requests, std::int64_t period_us);

  /// A page has come; `hello` is its first message.
  PageMessage opened(web::ClientId client, const nlohmann::ordered_json& hello);
  /// A page has gone.
  void closed(web::ClientId client) { clients_.erase(client); }
  /// A page said something. Gives answers; where it is not of the protocol, none but `refusal`:
  /// the client is to be closed.
  std::vector<PageMessage> take(web::ClientId client, const std::string& text,
                                std::optional<std::string>& refusal);
  /// The frames that are due. `extra` is added to the header of each. `wall_us`: now, where the
  /// runs are of logs; none: each run's newest message came when the run says.
  std::vector<PageMessage> frames(std::int64_t now_us, const nlohmann::ordered_json& extra,
                                  std::optional<std::int64_t> wall_us = std::nullopt);

  /// Pages that look.
  std::size_t size() const { return clients_.size(); }
  /// Pictures that were left out because a page was slow, of all pages so far.
  std::uint64_t skipped() const { return skipped_; }
  /// From the newest message in a frame to the screen, as the pages say [us].
  const bus::LatencyHistogram& to_screen() const { return to_screen_; }

 private:
  struct Client {
    std::vector<SceneCursor> cursors;
    std::set<std::string> overlays;
    std::map<std::uint64_t, double> on_the_way;  ///< By sequence: wall_ms.
    std::uint64_t sequence = 0;
    std::uint64_t skipped = 0;
    std::int64_t last_us = 0;  ///< When it last got a frame, or missed one.
    bool has_more = false;     ///< The last frame was a piece.
    std::size_t next_run = 0;
  };
  void acknowledge(Client& client, const nlohmann::json& message);
  std::optional<std::size_t> run_with_news(const Client& client) const;
  bool is_due(const Client& client, std::int64_t now_us) const;

  std::vector<const Scene*> runs_;
  PageRequests requests_;
  std::int64_t period_us_;
  std::map<web::ClientId, Client> clients_;
  std::uint64_t skipped_ = 0;
  bus::LatencyHistogram to_screen_;
};

}  // namespace understory::viewer
