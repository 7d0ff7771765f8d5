#include "deploy/cli/launch_voice.hpp"

#include <fmt/format.h>

#include "common/bus/clock.hpp"
#include "common/model/program_version.hpp"
#include "common/wire/convert.hpp"
#include "understory/health_t.hpp"

namespace understory::cli {
namespace {

constexpr const char* kGivenUpCode = "given_up";
constexpr std::chrono::seconds kTellEvery{1};

std::string why_given_up(const launch::ProcessStatus& process) {
  return fmt::format("given up, tried again from time to time; the last time: {}",
                     process.last_ending);
}

}  // namespace

LaunchVoice::LaunchVoice(const std::string& lcm_url)
    : bus_(lcm_url), announcer_(bus_, "launch", model::program_version()) {}

void LaunchVoice::tell(const std::vector<launch::ProcessStatus>& processes,
                       launch::Clock::time_point now) {
  for (const auto& process : processes) {
    if (process.is_given_up && given_up_.insert(process.name).second) {
      announcer_.log(-1, bus::LogLevel::kError, kGivenUpCode,
                     process.name + ": " + why_given_up(process), {});
    } else if (!process.is_given_up && given_up_.erase(process.name) > 0) {
      announcer_.log(-1, bus::LogLevel::kInfo, kGivenUpCode, process.name + ": over", {});
    }
  }

  if (told_ && now - *told_ < kTellEvery) return;
  told_ = now;
  for (const auto& process : processes) {
    if (process.is_given_up && process.pid <= 0) publish_health(process);
  }
}

void LaunchVoice::warn(const std::string& code, const std::string& text) {
  announcer_.log(-1, bus::LogLevel::kWarning, code, text, {});
}

void LaunchVoice::publish_health(const launch::ProcessStatus& process) {
  health_t health{};
  health.utime = bus::system_clock().wall_us();
  health.seq = sequences_[process.name]++;
  health.process = process.name;
  health.version = model::program_version();
  health.state = health_t::STATE_ERROR;
  health.message_utime = -1;
  health.snapshot_utime = -1;
  health.last_error_code = kGivenUpCode;
  health.last_error = why_given_up(process);
  health.last_error_utime = health.utime;
  bus_.publish("HEALTH", wire::encode_bytes(health));
}

}  // namespace understory::cli
