// `understory view`: the page over a recorded run, two of them, or a stored map with its history.
#include <fmt/format.h>
#include <poll.h>

#include <algorithm>
#include <chrono>
#include <memory>
#include <nlohmann/json.hpp>

#include "common/bus/clock.hpp"
#include "common/model/program_version.hpp"
#include "common/terminal/interrupt.hpp"
#include "common/terminal/progress.hpp"
#include "deploy/cli/commands.hpp"
#include "deploy/cli/failure.hpp"
#include "deploy/cli/log_player.hpp"
#include "deploy/cli/map_revisions.hpp"
#include "services/viewer/page_host.hpp"
#include "services/viewer/run.hpp"

namespace understory::cli {
namespace {

using viewer::PageHost;
using viewer::PageParameters;
using viewer::Scene;

constexpr int kTick_ms = 10;
constexpr std::int64_t kWork_us = 30'000;

struct ViewOptions {
  std::vector<std::string> logs;
  std::string map;
  PageParameters page;
  double rate = 1.0;
  bool is_paused = false;
};

std::int64_t monotonic_us() {
  return std::chrono::duration_cast<std::chrono::microseconds>(
             std::chrono::steady_clock::now().time_since_epoch())
      .count();
}

/// Runs until Ctrl-C: `step` returns additions to the headers of the frames.
template <class Step>
void serve(PageHost& host, Step step) {
  fmt::print("{}   (Ctrl-C ends)\n", host.url());
  std::fflush(stdout);
  pollfd file{host.file_descriptor(), POLLIN, 0};
  try {
    while (true) {
      terminal::throw_if_interrupted();
      host.attend(monotonic_us(), step(), bus::system_clock().wall_us());
      ::poll(&file, 1, kTick_ms);
    }
  } catch (const terminal::Interrupted&) {
    return;  // Ctrl-C ends this command normally.
  }
}

/// Time within the logs: plays, pauses, jumps.
class Playback {
 public:
  Playback(const LogSpan& span, double rate, bool is_playing)
      : span_(span), at_us_(span.from_us), rate_(rate), is_playing_(is_playing) {}

  /// Takes a page's request.
  void take(const nlohmann::json& control) {
    if (control.contains("seek") && control["seek"].is_number())
      at_us_ = std::clamp(static_cast<std::int64_t>(control["seek"].get<double>()), span_.from_us,
                          span_.to_us);
    if (!control.contains("play") || !control["play"].is_object()) return;
    const nlohmann::json& play = control["play"];
    if (play.contains("is_playing") && play["is_playing"].is_boolean())
      is_playing_ = play["is_playing"].get<bool>();
    if (play.contains("rate") && play["rate"].is_number())
      rate_ = std::clamp(play["rate"].get<double>(), 0.01, 1000.0);
    if (is_playing_ && at_us_ >= span_.to_us) at_us_ = span_.from_us;
  }
  /// Advances the time; waits if the logs have not reached it yet.
  void advance(std::int64_t passed_us, bool is_there) {
    if (!is_playing_ || !is_there) return;
    at_us_ = std::min(span_.to_us,
                      at_us_ + static_cast<std::int64_t>(rate_ * static_cast<double>(passed_us)));
    if (at_us_ == span_.to_us) is_playing_ = false;
  }
  std::int64_t at_us() const { return at_us_; }
  nlohmann::ordered_json json() const {
    return {{"utime", at_us_},
            {"from", span_.from_us},
            {"to", span_.to_us},
            {"rate", rate_},
            {"is_playing", is_playing_}};
  }

 private:
  LogSpan span_;
  std::int64_t at_us_;
  double rate_;
  bool is_playing_;
};

LogSpan span_of_logs(const std::vector<std::string>& logs) {
  std::optional<LogSpan> span;
  for (const std::string& log : logs) {
    terminal::Progress progress("reading " + log, 1.0);
    const LogSpan one = span_of_log(log, [&](double part) {
      terminal::throw_if_interrupted();
      progress.update(part);
    });
    if (!span) span = one;
    span->from_us = std::min(span->from_us, one.from_us);
    span->to_us = std::max(span->to_us, one.to_us);
  }
  return *span;
}

void view_logs(const ViewOptions& options) {
  const LogSpan span = span_of_logs(options.logs);
  std::vector<std::unique_ptr<viewer::Run>> hosted;
  std::vector<std::unique_ptr<LogPlayer>> players;
  std::vector<const Scene*> runs;
  nlohmann::ordered_json names = nlohmann::ordered_json::array();
  for (std::size_t i = 0; i < options.logs.size(); ++i) {
    hosted.push_back(std::make_unique<viewer::Run>());
    players.push_back(std::make_unique<LogPlayer>(options.logs[i], *hosted.back()));
    runs.push_back(&hosted.back()->scene());
    names.push_back({{"name", options.logs[i]}, {"colour_index", i}});
  }

  Playback playback(span, options.rate, !options.is_paused);
  viewer::PageRequests requests;
  requests.control = [&](const nlohmann::json& control) { playback.take(control); };
  requests.story = [&](const nlohmann::json& question) {
    return hosted.at(question.value("run", std::size_t{0}))->answer(question);
  };
  PageHost host(options.page, runs, std::move(requests),
                {{"version", model::program_version()},
                 {"mode", "log"},
                 {"runs", names},
                 {"log", {{"from", span.from_us}, {"to", span.to_us}}}});

  std::int64_t last_us = monotonic_us();
  serve(host, [&]() -> nlohmann::ordered_json {
    bool is_there = true;
    for (const auto& player : players) is_there &= player->go_to(playback.at_us(), kWork_us);
    const std::int64_t now_us = monotonic_us();
    playback.advance(now_us - last_us, is_there);
    last_us = now_us;
    return {{"player", playback.json()}};
  });
}

nlohmann::ordered_json revisions_json(const MapRevisions& revisions) {
  nlohmann::ordered_json list = nlohmann::ordered_json::array();
  for (const map_file::Change& change : revisions.changes()) {
    std::size_t landmarks = 0;
    for (const map_file::StoredMap& map : revisions.after(change.number))
      landmarks += map.landmarks.size();
    list.push_back({{"version", change.number},
                    {"utime", change.note.utime},
                    {"text", change.note.text},
                    {"landmarks", landmarks}});
  }
  return list;
}

void view_map(const ViewOptions& options) {
  const MapRevisions revisions(options.map);
  std::uint64_t version = revisions.changes().size();
  std::uint64_t base = version > 1 ? version - 1 : version;
  Scene shown;
  Scene compared;
  const auto show_both = [&] {
    show(revisions.after(version), shown);
    show(revisions.after(base), compared);
  };
  show_both();

  viewer::PageRequests requests;
  requests.control = [&](const nlohmann::json& control) {
    const auto number = [&](const char* key, std::uint64_t& value) {
      if (!control.contains(key) || !control[key].is_number_unsigned()) return;
      value = std::clamp<std::uint64_t>(control[key].get<std::uint64_t>(), 1,
                                        revisions.changes().size());
    };
    number("revision", version);
    number("base", base);
    show_both();
  };
  PageHost host(options.page, {&shown, &compared}, std::move(requests),
                {{"version", model::program_version()},
                 {"mode", "map"},
                 {"runs",
                  {{{"name", options.map}, {"colour_index", 0}},
                   {{"name", "compared with"}, {"colour_index", 1}}}},
                 {"revisions", revisions_json(revisions)}});
  serve(host, [&]() -> nlohmann::ordered_json {
    return {{"revision", {{"version", version}, {"base", base}}}};
  });
}

void view(const ViewOptions& options) {
  if (options.map.empty() == options.logs.empty())
    wrong_usage("view: either one or two logs, or --map FILE");
  terminal::catch_interrupts();
  try {
    options.map.empty() ? view_logs(options) : view_map(options);
  } catch (const terminal::Interrupted&) {
    return;
  } catch (const std::runtime_error& error) {
    // Error of the log, the map or the port; the text names it.
    fail(error.what());
  }
}

}  // namespace

void add_view_command(CLI::App& parent) {
  auto* command = parent.add_subcommand(
      "view",
      "The viewer's page over a log, two runs of one log, or a stored map with its history");
  auto options = std::make_shared<ViewOptions>();
  command->add_option("logs", options->logs, "One or two LCM logs with the outputs of a run")
      ->expected(0, 2);
  command->add_option("--map", options->map, "A map file (see `understory map`)");
  command
      ->add_option("--port", options->page.port,
                   "Port of the page, or one of the nine above it; 0: any free port")
      ->check(CLI::Range(0, 65535))
      ->capture_default_str();
  command->add_option("--rate", options->rate, "Speed of the playback, as a multiple of real time")
      ->check(CLI::Range(0.01, 1000.0))
      ->capture_default_str();
  command->add_flag("--paused", options->is_paused, "Start paused at the beginning");
  command->callback([options] { view(*options); });
}

}  // namespace understory::cli
