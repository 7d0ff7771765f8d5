#include "services/viewer/adapter_parameters.hpp"

namespace understory::viewer {

void describe(ViewerParameters& parameters, bus::ParameterTable& table) {
  PageParameters& page = parameters.page;
  table.add("page.address", page.address, {}, "Address to listen on, in numbers.");
  table.add("page.port", page.port, {0, 65535}, "",
            "Port; if it is taken, one of the nine above it. 0: any free one. LOG names it.");
  table.add("page.beyond_loopback", page.beyond_loopback,
            "Allow an address that other computers reach. There is no password and no encryption.");
  table.add("page.host_names", page.host_names, {},
            "Comma-separated names of this computer that browsers may use, besides localhost and "
            "addresses.");
  table.add("page.rate_hz", page.rate_hz, {0.1, 100.0}, "Hz",
            "Most updates of one page; without a new pose a third of it.");
  table.add("page.most_clients", page.most_clients, {1, 1000}, "", "Most connections at a time.");
  table.add("page.foxglove_origins", page.foxglove_origins, {},
            "Comma-separated origins of other viewers' pages that may connect.");
  table.add("page.niceness", parameters.niceness, {0, 19}, "",
            "Nice value of the process: 0 normal, 19 lowest priority.");
  table.add("input.sweeps", parameters.hears_sweeps,
            "Also receive LIDAR_SWEEP and draw its points: 20 MB/s of a large laser.");
  table.add("input.watch_processes", parameters.watches_processes,
            "Check in this computer's kernel whether each process runs: a dead one is red at once. "
            "False: processes run on other computers.");
}

}  // namespace understory::viewer
