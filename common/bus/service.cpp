#include "common/bus/service.hpp"

#include <sstream>
#include <stdexcept>

#include "common/model/program_version.hpp"

namespace understory::bus {
namespace {

std::vector<std::string> split_at_commas(const std::string& text) {
  std::vector<std::string> parts;
  std::istringstream stream(text);
  for (std::string part; std::getline(stream, part, ',');) {
    if (!part.empty()) parts.push_back(part);
  }
  return parts;
}

}  // namespace

void describe(RuntimeParameters& parameters, ParameterTable& table) {
  table.add("runtime.lcm_url", parameters.lcm_url, {},
            "Bus, e.g. udpm://239.255.76.67:7667?ttl=0; empty: LCM_DEFAULT_URL or LCM's default.");
  table.add("runtime.channel_suffix", parameters.channel_suffix, {},
            "Appended to the name of every output, to run two variants side by side.");
  table.add("runtime.suffixed_inputs", parameters.suffixed_inputs, {},
            "Inputs, separated by commas, whose names get the suffix, too.");
  table.add("runtime.snapshot_every_s", parameters.snapshot_every_s, {0.1, 3600.0}, "s",
            "Message time between two snapshots of the state.");
  table.add("runtime.snapshot_every_events", parameters.snapshot_every_events, {1, 1000000}, "",
            "Inputs between two snapshots of the state.");
  table.add("runtime.largest_clock_jump_s", parameters.largest_clock_jump_s, {0.1, 86400.0}, "s",
            "A message whose stamp is farther from the others waits until three consecutive ones "
            "agree; else it is refused. Slower or later channels are not checked.");
  table.add("runtime.refused_of_last_32", parameters.refused_of_last_32, {1, 32}, "messages",
            "HEALTH says input_refused if this many of an input's last 32 messages were refused or "
            "late, until a quarter of them is left.");
}

NodeOptions node_options(const std::string& process, const RuntimeParameters& parameters) {
  NodeOptions options;
  options.process = process + parameters.channel_suffix;
  options.version = model::program_version();
  options.channel_suffix = parameters.channel_suffix;
  options.suffixed_inputs = split_at_commas(parameters.suffixed_inputs);
  options.largest_clock_jump_us = static_cast<model::Utime>(parameters.largest_clock_jump_s * 1e6);
  options.refused_of_last_32 = parameters.refused_of_last_32;
  options.snapshot_every_us = static_cast<model::Utime>(parameters.snapshot_every_s * 1e6);
  options.snapshot_every_events = parameters.snapshot_every_events;
  return options;
}

HostedService::HostedService(const Service& service, Bus& bus, const Clock& clock,
                             const std::string& toml, const std::string& toml_name,
                             const std::function<void(RuntimeParameters&)>& adjust)
    : adapter_(service.make()) {
  describe(runtime_, table_);
  adapter_->describe(table_);
  table_.load_text(toml, toml_name);
  if (adjust) adjust(runtime_);
  node_ = std::make_unique<Node>(bus, node_options(service.name, runtime_), clock);
  adapter_->bind(*node_);
  const std::string difference = service.channels.difference(node_->channels());
  if (!difference.empty()) throw std::logic_error(service.name + ": " + difference);
  node_->keep_state([this] { return adapter_->save(); },
                    [this](const std::string& state) { adapter_->load(state); },
                    [this](std::int64_t written_s) { adapter_->state_was_lost(written_s); });
}

}  // namespace understory::bus
