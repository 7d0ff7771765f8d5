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

/// What is replayed, through which services, into which file.
struct ReplayOptions {
  std::filesystem::path log;
  std::filesystem::path out;         ///< Empty = nothing is written.
  std::vector<Service> services;     ///< Hosted, bound in this order.
  std::filesystem::path config_dir;  ///< As config_file_in(); may be empty: defaults.
  /// By service: values that replace those of its file, and what they come from, for messages.
  std::map<std::string, ConfigLayer> layers;
  std::string channel_suffix;  ///< Of the outputs of every hosted service.
  bool keeps_inputs = true;    ///< The log's own events go into `out` too.
  /// Called every 256 events with the part done, 0..1; true = stop here, write nothing.
  std::function<bool(double)> progress;
};

/// What a replay did.
struct ReplayReport {
  std::uint64_t events = 0;  ///< Read from the log.
  std::uint64_t fed = 0;     ///< Of them taken by a hosted service.
  std::uint64_t left_out =
      0;  ///< Recorded outputs of hosted services, and their HEALTH, LOG, CONFIG.
  std::uint64_t derived = 0;         ///< Published by hosted services.
  std::uint64_t damaged_places = 0;  ///< Of the log.
  std::uint64_t damaged_bytes = 0;
  bool was_stopped = false;
  std::vector<health_t> health;  ///< Of each service at the end; clock figures are zero.
};

/// After each event of the log the messages derived from it are handed out, in the order in which
/// they were published, until none is left. Recorded outputs of hosted services are not fed.
/// Derived events carry the log time of the event that caused them. `out` is written whole or not
/// at all. Throws LogError, also where no event of the log is an input of a service, and
/// ConfigurationError.
ReplayReport replay(const ReplayOptions& options);

}  // namespace understory::bus
