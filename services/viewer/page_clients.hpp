// The browsers with an open page: frames to each, and requests from them.
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

/// Requests of pages beside frames; each returns the text of a refusal, or none.
struct PageRequests {
  /// Answers a question with the object `story`. Throws std::runtime_error with the reason if there
  /// is none.
  std::function<nlohmann::ordered_json(const nlohmann::json& question)> story;
  /// Plays, pauses, seeks, or selects a revision.
  std::function<void(const nlohmann::json& control)> control;
};

/// A message for a client.
struct PageMessage {
  web::ClientId client = 0;
  std::shared_ptr<const std::string> bytes;
};

/// Flow control of all pages (protocol.md): at most two frames are in transit, and the next one
/// contains all changes since. Poses set the pace: other changes are sent with the next pose, or
/// after three periods, since each picture makes the browser redraw the whole window. Pure: the
/// caller has the sockets and the clock.
class PageClients {
 public:
  /// `runs` must outlive it. `period_us`: least time between two frames of a client.
  PageClients(std::vector<const Scene*> runs, PageRequests requests, std::int64_t period_us);

  /// A page was opened; `hello` is its first message.
  PageMessage opened(web::ClientId client, const nlohmann::ordered_json& hello);
  /// A page was closed.
  void closed(web::ClientId client) { clients_.erase(client); }
  /// Handles a message of a page. Returns the answers; a message outside the protocol gives only
  /// `refusal`: then close the client.
  std::vector<PageMessage> take(web::ClientId client, const std::string& text,
                                std::optional<std::string>& refusal);
  /// The frames that are due. `extra` is added to the header of each. `wall_us`: the present time
  /// for runs from logs; none: the reception time of each run's newest message.
  std::vector<PageMessage> frames(std::int64_t now_us, const nlohmann::ordered_json& extra,
                                  std::optional<std::int64_t> wall_us = std::nullopt);

  /// Number of open pages.
  std::size_t size() const { return clients_.size(); }
  /// Number of pictures skipped because a page was slow, over all pages so far.
  std::uint64_t skipped() const { return skipped_; }
  /// Latency from the newest message in a frame to the screen, reported by the pages [us].
  const bus::LatencyHistogram& to_screen() const { return to_screen_; }

 private:
  struct Client {
    std::vector<SceneCursor> cursors;
    std::set<std::string> overlays;
    std::map<std::uint64_t, double> on_the_way;  ///< By sequence: wall_ms.
    std::uint64_t sequence = 0;
    std::uint64_t skipped = 0;
    std::int64_t last_us = 0;  ///< Time of its last frame, sent or missed.
    bool has_more = false;     ///< The last frame was incomplete.
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
