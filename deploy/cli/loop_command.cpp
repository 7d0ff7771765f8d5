// `understory loop`: loop closures set and revoked by hand, live.
#include <fmt/format.h>

#include <chrono>
#include <memory>
#include <numbers>
#include <optional>
#include <string>

#include "common/bus/live_bus.hpp"
#include "common/terminal/interrupt.hpp"
#include "common/terminal/printable.hpp"
#include "common/wire/convert.hpp"
#include "deploy/cli/commands.hpp"
#include "deploy/cli/failure.hpp"
#include "deploy/cli/loop_end.hpp"

namespace understory::cli {
namespace {

using WaitClock = std::chrono::steady_clock;
using Status = model::LoopResult::Status;

/// Interval of repetition until the mapper answers, because messages may be lost.
constexpr std::chrono::milliseconds kAgain{500};

struct LoopOptions {
  std::string from;
  std::string to;
  double x_m = 0.0;
  double y_m = 0.0;
  double theta_deg = 0.0;
  double sigma_m = 0.1;
  double sigma_deg = 0.5;
  std::uint64_t id = 0;
  std::uint32_t map_id = 1;
  double timeout_s = 5.0;
  std::string lcm_url;
};

/// The same closure has the same number, so a repetition is harmless.
std::uint64_t id_of(const LoopOptions& options) {
  if (options.id != 0) return options.id;
  const std::string text = fmt::format("{} {} {} {} {}", options.from, options.to, options.x_m,
                                       options.y_m, options.theta_deg);
  return manual_closure_id(text);
}

model::LoopClosure closure_of(const LoopOptions& options) {
  model::LoopClosure closure;
  closure.map_id = options.map_id;
  closure.id = id_of(options);
  closure.source = "manual";
  closure.from = loop_end_of("--from", options.from);
  closure.to = loop_end_of("--to", options.to);
  const double degree = std::numbers::pi / 180.0;
  closure.from_T_to.mean = geometry::SE2(options.x_m, options.y_m, options.theta_deg * degree);
  const Eigen::Vector3d sigma(options.sigma_m, options.sigma_m, options.sigma_deg * degree);
  closure.from_T_to.covariance = sigma.array().square().matrix().asDiagonal();
  return closure;
}

/// Sends it until the mapper answers. Throws CLI::RuntimeError without an answer.
model::LoopResult answer_to(const model::LoopClosure& closure, const LoopOptions& options) {
  bus::LiveBus bus(options.lcm_url);
  std::optional<model::LoopResult> answer;
  bus.subscribe("LOOP_RESULT", 100, [&](const bus::BusMessage& message) {
    const auto result = wire::decode_message<model::LoopResult>(message.bytes);
    if (result && result->closure_id == closure.id && result->map_id == closure.map_id)
      answer = *result;
  });

  const auto end = WaitClock::now() + std::chrono::duration<double>(options.timeout_s);
  auto again = WaitClock::now();
  while (!answer && WaitClock::now() < end) {
    terminal::throw_if_interrupted();
    if (WaitClock::now() >= again) {
      if (const auto refusal = bus.publish("LOOP_CLOSURE", wire::encode_message(closure)))
        fail("loop: LOOP_CLOSURE: not sent: " + refusal->detail);
      again += kAgain;
    }
    bus.handle_one(50);
  }
  if (!answer)
    fail(fmt::format("loop: LOOP_RESULT: no mapper answered within {} s", options.timeout_s));
  return *answer;
}

void tell(const model::LoopResult& result) {
  const char* const status = result.status == Status::kAccepted  ? "accepted"
                             : result.status == Status::kWaiting ? "waiting"
                             : result.status == Status::kRevoked ? "revoked"
                                                                 : "refused";
  const std::string text =
      fmt::format("closure {} of map {}: {}{}{}", result.closure_id, result.map_id, status,
                  result.reason.empty() ? "" : ": ", terminal::printable(result.reason));
  if (result.status == Status::kRefused) fail("loop: " + text);
  fmt::print("{}\n", text);
}

void close_loop(const LoopOptions& options) {
  terminal::catch_interrupts();
  tell(answer_to(closure_of(options), options));
}

void revoke_loop(const LoopOptions& options) {
  terminal::catch_interrupts();
  model::LoopClosure closure;
  closure.map_id = options.map_id;
  closure.id = options.id;
  closure.source = "manual";
  closure.is_revoked = true;
  closure.from_T_to.covariance = Eigen::Matrix3d::Identity();
  tell(answer_to(closure, options));
}

void add_common_options(CLI::App& command, LoopOptions& options) {
  command.add_option("--map-id", options.map_id, "Number of the map")
      ->check(CLI::Range(1, 65535))
      ->capture_default_str();
  command.add_option("--timeout", options.timeout_s, "Longest wait for the mapper [s]")
      ->check(CLI::Range(0.1, 3600.0))
      ->capture_default_str();
  command.add_option("--lcm-url", options.lcm_url, "Bus, e.g. udpm://239.255.76.67:7667?ttl=0");
}

void add_close(CLI::App& parent) {
  auto* command = parent.add_subcommand(
      "close",
      "Sets the relative pose of two places (default: one place); used if the graph allows it");
  auto options = std::make_shared<LoopOptions>();
  command->add_option("--from", options->from, "keyframe:N, or submap:N after it was handed over")
      ->required();
  command->add_option("--to", options->to, "Likewise")->required();
  command->add_option("--x", options->x_m, "Position of `to` in the frame of `from`, ahead [m]")
      ->capture_default_str();
  command->add_option("--y", options->y_m, "Likewise, to the left [m]")->capture_default_str();
  command
      ->add_option("--theta-deg", options->theta_deg,
                   "Heading of `to` in the frame of `from` [degrees]")
      ->capture_default_str();
  command->add_option("--sigma", options->sigma_m, "Standard deviation of x and of y [m]")
      ->check(CLI::Range(1e-3, 1e3))
      ->capture_default_str();
  command
      ->add_option("--sigma-deg", options->sigma_deg, "Standard deviation of the heading [degrees]")
      ->check(CLI::Range(1e-3, 180.0))
      ->capture_default_str();
  command
      ->add_option("--id", options->id,
                   "Number of the closure (default: made from the other options)")
      ->check(CLI::Range(std::uint64_t{1}, kManualClosures - 1));
  add_common_options(*command, *options);
  command->callback([options] { close_loop(*options); });
}

void add_revoke(CLI::App& parent) {
  auto* command = parent.add_subcommand("revoke", "Revokes a closure, set by hand or found");
  auto options = std::make_shared<LoopOptions>();
  command->add_option("id", options->id, "Number of the closure, as LOOP_CLOSURE has it")
      ->required()
      ->check(CLI::Range(std::uint64_t{1}, std::uint64_t{1} << 62));
  add_common_options(*command, *options);
  command->callback([options] { revoke_loop(*options); });
}

}  // namespace

void add_loop_command(CLI::App& parent) {
  auto* loop = parent.add_subcommand("loop", "Loop closures by hand, in the mapper that runs");
  loop->require_subcommand(1);
  add_close(*loop);
  add_revoke(*loop);
}

}  // namespace understory::cli
