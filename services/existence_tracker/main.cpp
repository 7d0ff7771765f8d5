// The existence tracker's process. Its channels: TrackerChannels in adapter.hpp, and --help.
#include "services/existence_tracker/adapter.hpp"

int main(int argc, char** argv) {
  return understory::bus::run_service(understory::existence_tracker::existence_tracker_service(),
                                      argc, argv);
}
