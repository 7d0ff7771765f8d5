#include "deploy/cli/paths.hpp"

#include <cstdlib>

namespace understory::cli {
namespace {

std::string environment(const char* name) {
  const char* value = std::getenv(name);
  return value != nullptr ? value : "";
}

}  // namespace

std::filesystem::path executable_directory() {
  std::error_code error;
  return std::filesystem::read_symlink("/proc/self/exe", error).parent_path();
}

std::string find_executable(const std::string& name) {
  if (name.find('/') != std::string::npos) return name;
  const auto beside = executable_directory() / name;
  return std::filesystem::exists(beside) ? beside.string() : name;
}

std::filesystem::path default_config_directory() {
  if (const auto chosen = environment("UNDERSTORY_CONFIG"); !chosen.empty()) return chosen;
  const std::filesystem::path installed = UNDERSTORY_INSTALLED_CONFIG;
  return std::filesystem::exists(installed / "launch.toml") ? installed : UNDERSTORY_SOURCE_CONFIG;
}

std::filesystem::path default_state_directory() {
  if (const auto chosen = environment("UNDERSTORY_STATE"); !chosen.empty()) return chosen;
  if (const auto xdg = environment("XDG_STATE_HOME"); !xdg.empty()) {
    return std::filesystem::path(xdg) / "understory";
  }
  return std::filesystem::path(environment("HOME")) / ".local" / "state" / "understory";
}

}  // namespace understory::cli
