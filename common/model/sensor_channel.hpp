// Channels with readings of sensors.
#pragma once

#include <string_view>

namespace understory::model {

/// RAW_POSE has the prefix of sensors' channels, but is dead reckoning, an output.
inline bool is_sensor_channel(std::string_view channel) {
  return channel.starts_with("RAW_") && channel != "RAW_POSE";
}

}  // namespace understory::model
