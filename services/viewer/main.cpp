// The viewer's process: a web page on loopback. Its channels: scene_channels.hpp, and --help.
#include "services/viewer/adapter.hpp"

int main(int argc, char** argv) {
  return understory::bus::run_service(understory::viewer::viewer_service(), argc, argv);
}
