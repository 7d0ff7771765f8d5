// Replay: chosen services in one process, a log in, a log out, the same bytes every time.
#pragma once

#include <filesystem>
#include <functional>
#include <map>
#include <string>
#include <vector>

#include "common/bus/config_layers.hpp"
#include "common/bus/service.hpp"
#include "understory/health_t.hpp"

namespace understory::bus {

/// Input log, services and output file of a replay.
struct ReplayOptions {
  std::filesystem::path log;
  std::filesystem::path out;         ///< Empty = nothing is written.
  std::vector<Service> services;     ///< Hosted services, bound in this order.
  std::filesystem::path config_dir;  ///< As for config_file_in(); empty = defaults.
  /// By service: values that replace those of its file, with their origin for messages.
  std::map<std::string, ConfigLayer> layers;
  std::string channel_suffix;  ///< Suffix of the outputs of every hosted service.
  bool keeps_inputs = true;    ///< The log's own events are copied to `out` too.
  /// Called every 256 events with the fraction done, 0..1; true = stop and write nothing.
  std::function<bool(double)> progress;
};

/// Result of a replay.
struct ReplayReport {
  std::uint64_t events = 0;  ///< Events of the log.
  std::uint64_t fed = 0;     ///< Events handled by a hosted service.
  std::uint64_t left_out =
      0;  ///< Recorded outputs of hosted services, and their HEALTH, LOG, CONFIG.
  std::uint64_t derived = 0;         ///< Messages published by hosted services.
  std::uint64_t damaged_places = 0;  ///< Damaged places of the log.
  std::uint64_t damaged_bytes = 0;
  bool was_stopped = false;
  std::vector<health_t> health;  ///< HEALTH of each service at the end; clock figures are zero.
};

/// After each event of the log, the messages derived from it are handled in the order of
/// publication, until none is left. Recorded outputs of hosted services are skipped. Derived events
/// carry the log time of the event that caused them. `out` is written completely or not at all.
/// Throws ConfigurationError, and LogError, also where no event of the log is an input of a
/// service.
ReplayReport replay(const ReplayOptions& options);

}  // namespace understory::bus
