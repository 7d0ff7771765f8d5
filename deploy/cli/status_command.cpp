// `understory status`: a live table of HEALTH.
#include <fmt/format.h>
#include <unistd.h>

#include <chrono>
#include <cstdio>
#include <memory>
#include <nlohmann/json.hpp>

#include "common/bus/clock.hpp"
#include "common/terminal/interrupt.hpp"
#include "deploy/cli/commands.hpp"
#include "deploy/cli/failure.hpp"
#include "deploy/cli/health_listener.hpp"
#include "deploy/cli/status_table.hpp"
#include "deploy/cli/text_file.hpp"
#include "services/viewer/scene.hpp"

namespace understory::cli {
namespace {

using Clock = StatusTable::Clock;

struct StatusOptions {
  std::string lcm_url;
  bool once = false;
  bool json = false;
};

void listen_until(HealthListener& listener, Clock::time_point end) {
  while (Clock::now() < end) {
    terminal::throw_if_interrupted();
    const auto left = std::chrono::ceil<std::chrono::milliseconds>(end - Clock::now());
    listener.handle(std::max(std::chrono::milliseconds(1), left));
  }
}

/// The verdict on the pose is first, in the words of the viewer's page.
void print(const StatusTable& table, const viewer::Scene& scene, bool json) {
  const auto now = Clock::now();
  const viewer::Verdict verdict = pose_verdict(scene.verdict().value, table);
  if (json) {
    nlohmann::ordered_json document = table.json(now);
    document["pose"] = {{"state", viewer::state_name(verdict.state)}, {"text", verdict.text}};
    fmt::print("{}\n", result_text(document, 2));
  } else {
    fmt::print("pose: {} ({})\n{}", viewer::state_name(verdict.state), verdict.text,
               table.text(now));
  }
  std::fflush(stdout);
}

void status(const StatusOptions& options) {
  terminal::catch_interrupts();
  StatusTable table;
  HealthListener listener(options.lcm_url,
                          [&](const health_t& health) { table.add(health, Clock::now()); });

  viewer::Scene scene;
  const bus::Clock clock = bus::system_clock();
  listener.hear_poses([&](const model::SlamPose& pose) { scene.take(pose, clock.wall_us()); });

  if (options.once) {
    // HEALTH is published once a second: every running process has sent one by then.
    listen_until(listener, Clock::now() + std::chrono::milliseconds(1500));
    scene.look(clock.wall_us());
    print(table, scene, options.json);
    if (table.empty()) fail("status: no process is heard on HEALTH");
    return;
  }

  const bool terminal = ::isatty(STDOUT_FILENO) == 1;
  try {
    while (true) {
      listen_until(listener, Clock::now() + std::chrono::seconds(1));
      if (terminal) fmt::print("\033[H\033[2J");
      scene.look(clock.wall_us());
      print(table, scene, options.json);
    }
  } catch (const terminal::Interrupted&) {
    return;  // Ctrl-C ends this command normally.
  }
}

}  // namespace

void add_status_command(CLI::App& parent) {
  auto* command = parent.add_subcommand("status", "A live table of the processes' health");
  auto options = std::make_shared<StatusOptions>();
  command->add_option("--lcm-url", options->lcm_url, "Bus, e.g. udpm://239.255.76.67:7667?ttl=0");
  command->add_flag("--once", options->once, "Listen for 1.5 s, print, end");
  command->add_flag("--json", options->json, "As JSON");
  command->callback([options] { status(*options); });
}

}  // namespace understory::cli
