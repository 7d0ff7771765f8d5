// The associator's process. Its channels: AssociatorChannels in adapter.hpp, and --help.
#include "services/associator/adapter.hpp"

int main(int argc, char** argv) {
  return understory::bus::run_service(understory::associator::associator_service(), argc, argv);
}
