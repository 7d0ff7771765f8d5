// The interface of services and drivers: a service describes its parameters, binds its channels and
// can save its state.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <string>

#include "common/bus/channel_list.hpp"
#include "common/bus/node.hpp"
#include "common/bus/parameter_table.hpp"

namespace understory::bus {

/// Connects a stage to its channels: it neither decodes nor computes.
class Adapter {
 public:
  virtual ~Adapter() = default;
  /// Lists the parameters, bound to the adapter's own structs.
  virtual void describe(ParameterTable& table) = 0;
  /// Called with loaded parameters: makes the stage, subscribes and advertises.
  virtual void bind(Node& node) = 0;
  /// The last call, at the end of the drive or of the process. May publish.
  virtual void finish() {}
  /// The stage's state as bytes; empty = no state.
  virtual std::string save() const { return {}; }
  /// Restores the result of save(). Throws on failure; the adapter is then discarded.
  virtual void load(const std::string& /*state*/) {}
  /// Called before the first input if the state of an earlier process cannot be used. Other
  /// processes still have that process's messages, so numbers must not restart. `written_s`: when
  /// the state was written [s since 1970]; grows with each lost state, and stays the same until a
  /// snapshot of the new state is saved.
  virtual void state_was_lost(std::int64_t /*written_s*/) {}
};

/// A service by name, and the maker of its adapter.
struct Service {
  std::string name;      ///< As in the executable's name and in HEALTH, e.g. keyframer.
  ChannelList channels;  ///< Exactly the channels that its adapter binds.
  std::function<std::unique_ptr<Adapter>()> make;
};

/// Parameters that every process has (table `runtime` of its file).
struct RuntimeParameters {
  std::string lcm_url;                 ///< Empty = LCM_DEFAULT_URL, or LCM's default group.
  std::string channel_suffix;          ///< Suffix of every output.
  std::string suffixed_inputs;         ///< Comma-separated inputs that carry the suffix too.
  double snapshot_every_s = 30.0;      ///< Message time between two snapshots.
  int snapshot_every_events = 1000;    ///< Inputs between two snapshots.
  double largest_clock_jump_s = 10.0;  ///< Largest jump of a stamp without proof.
  int refused_of_last_32 = 16;         ///< Refused messages among the latest 32 of an input.
};
/// Adds them to `table`, bound to `parameters`, which must outlive it.
void describe(RuntimeParameters& parameters, ParameterTable& table);

/// The options that follow from the parameters.
NodeOptions node_options(const std::string& process, const RuntimeParameters& parameters);

/// One running instance: parameters, adapter and node together.
class HostedService {
 public:
  /// `toml` and its name, as for ParameterTable::load_text; throws ConfigurationError. `adjust`
  /// gets the runtime parameters after loading and may change them. Throws std::logic_error where
  /// the adapter binds other channels than the service declares.
  HostedService(const Service& service, Bus& bus, const Clock& clock, const std::string& toml,
                const std::string& toml_name,
                const std::function<void(RuntimeParameters&)>& adjust = {});

  /// The service's place on the bus.
  Node& node() { return *node_; }
  /// The adapter, bound.
  Adapter& adapter() { return *adapter_; }
  /// All parameters, loaded.
  const ParameterTable& table() const { return table_; }
  /// The runtime parameters in force.
  const RuntimeParameters& runtime() const { return runtime_; }

 private:
  RuntimeParameters runtime_;
  std::unique_ptr<Adapter> adapter_;
  ParameterTable table_;
  std::unique_ptr<Node> node_;
};

/// Runs a whole process: reads the command line (--config, --lcm-url, --state-dir,
/// --channel-suffix, --print-config, --help, --version), runs until SIGTERM or SIGINT, saves the
/// state. Returns the exit status: 0 done, 1 failed, 2 wrong usage or configuration. Call it from
/// main().
int run_service(const Service& service, int argc, char** argv);

}  // namespace understory::bus
