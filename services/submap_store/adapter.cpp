#include "services/submap_store/adapter.hpp"

#include <fmt/format.h>

#include <cmath>
#include <limits>
#include <memory>
#include <optional>
#include <stdexcept>

#include "common/bus/device.hpp"
#include "services/submap_store/adapter_parameters.hpp"
#include "services/submap_store/drive_folder.hpp"
#include "services/submap_store/storage_watch.hpp"
#include "services/submap_store/submap_store.hpp"
#include "understory/map_request_t.hpp"

namespace understory::submap_store {
namespace {

using map_file::DriveFile;
using map_file::Fault;
using map_file::MapFileError;

constexpr model::Utime kSecond_us = 1'000'000;
/// Message time between requests for the whole map, and between attempts after a fault of the file.
constexpr model::Utime kAskAgain_us = 5 * kSecond_us;
constexpr model::Utime kTryAgain_us = kSecond_us;
constexpr int kWait_ms = 1000;
/// A SUBMAP with its keyframes and payload is this many times larger than its landmarks.
constexpr std::size_t kSubmapParts = 8;
constexpr std::size_t kAll = std::numeric_limits<std::size_t>::max();

class StoreAdapter : public bus::Adapter, public bus::Device {
 public:
  explicit StoreAdapter(StoreChannels channels) : channels_(std::move(channels)) {}

  void describe(bus::ParameterTable& table) override { submap_store::describe(parameters_, table); }

  void bind(bus::Node& node) override {
    node_ = &node;
    subscribe_to_submaps(node);
    subscribe_to_ground(node);
    stored_ = node.advertise<model::SubmapStored>(channels_.submap_stored);
    replies_ = node.advertise<model::Submap>(channels_.submap_reply);
    requests_ = node.advertise<map_request_t>(channels_.map_request);
    node.every(static_cast<model::Utime>(parameters_.writing.ground_period_s * 1e6),
               [this](model::Utime now) { write_ground(now, moved_per_period()); });
    node.every(kSecond_us, [this](model::Utime now) { tick(now); });
  }

  // The file has the state; this is the part not written yet.
  std::string save() const override { return stage_.save(); }
  void load(const std::string& state) override { stage_.load(state); }

  void finish() override {
    next_try_ = -1;
    write_ground(node_->now(), kAll);
    if (folder_ && !folder_->finish())
      node_->log(bus::Node::Level::kInfo, "not_sealed",
                 "the map's file is completed by who opens it next", channels_.submap);
  }

  // Device: the files.

  void set_state_directory(const std::filesystem::path& directory) override {
    state_directory_ = directory;
  }
  void open() override {
    std::filesystem::path folder = parameters_.file.folder;
    if (folder.empty() && !state_directory_.empty()) folder = state_directory_ / bus::kKeptFolder;
    if (folder.empty())
      throw std::runtime_error("file.folder: name a folder for the maps, or give --state-dir");
    folder_ = std::make_unique<DriveFolder>(folder, parameters_.file);
  }
  std::vector<int> file_descriptors() const override { return {}; }
  void attend(std::int64_t /*monotonic_us*/) override {}
  int wait_ms() const override { return kWait_ms; }

 private:
  // Nothing is journaled: missed changes are in the next MAP, which is requested.

  void subscribe_to_submaps(bus::Node& node) {
    const auto landmarks = static_cast<std::size_t>(parameters_.input.max_landmarks);
    node.subscribe<model::Submap>(
        channels_.submap, [this](const model::Submap& submap) { keep(submap); },
        {.queue_size = 200,
         .most_bytes = kSubmapParts * wire::bytes_with<submap_t, map_landmark_t>(landmarks),
         .journaled = false});
    node.subscribe<model::SubmapQuery>(channels_.submap_query,
                                       [this](const model::SubmapQuery& query) { answer(query); },
                                       {.queue_size = 50, .journaled = false});
    node.subscribe<model::MapCorrection>(
        channels_.map_correction,
        [this](const model::MapCorrection& correction) { correct(correction); },
        {.journaled = false});
    // Any process may send one, with a stamp of another time.
    node.subscribe<model::LoopClosure>(channels_.loop_closure,
                                       [this](const model::LoopClosure& one) { stage_.take(one); },
                                       {.sequenced = false, .timed = false, .journaled = false});
    node.subscribe<model::LoopResult>(channels_.loop_result,
                                      [this](const model::LoopResult& one) { stage_.take(one); },
                                      {.journaled = false});
  }

  void subscribe_to_ground(bus::Node& node) {
    const auto landmarks = static_cast<std::size_t>(parameters_.input.max_map_landmarks);
    const bus::SubscribeOptions options{
        .queue_size = 100,
        .most_bytes = wire::bytes_with<map_t, map_landmark_t>(landmarks) * 2,
        .journaled = false};
    node.subscribe<model::WholeMap>(
        channels_.map, [this](const model::WholeMap& map) { stage_.take(map); }, options);
    node.subscribe<model::MapDelta>(
        channels_.map_delta, [this](const model::MapDelta& delta) { stage_.take(delta); }, options);
    node.subscribe<model::MapUpdate>(channels_.slam_update,
                                     [this](const model::MapUpdate& update) { follow(update); },
                                     {.queue_size = 200, .journaled = false});
    node.subscribe<model::ExistenceState>(
        channels_.existence_state,
        [this](const model::ExistenceState& state) { take_existence(state); },
        {.queue_size = 500, .journaled = false});
  }

  /// An invalid state must not prevent the others from being written.
  void take_existence(const model::ExistenceState& state) {
    const std::string fault = map_file::fault_of(state);
    if (fault.empty()) {
      stage_.take(state);
    } else {
      node_->report(wire::Reason::kInputRefused, fault, channels_.existence_state);
    }
  }

  /// Works on the drive's file. A fault is reported once, and stays in HEALTH as long as it lasts;
  /// the drive continues; returns false. A damaged file is skipped, and the work is done in the
  /// next one.
  template <class Work>
  bool with_file(model::Utime now, const std::string& channel, const Work& work) {
    if (next_try_ >= 0 && now >= 0 && now < next_try_ && now >= next_try_ - kTryAgain_us)
      return false;
    bool is_done = false;
    constexpr int kFiles = 2;
    for (int tries = 0; tries < kFiles && !is_done; ++tries) {
      is_done = worked(now, channel, work);
      if (next_try_ >= 0) break;
    }
    for (const bus::WatchedCondition& one : watch_.conditions()) node_->show(one);
    return is_done;
  }

  template <class Work>
  bool worked(model::Utime now, const std::string& channel, const Work& work) {
    try {
      if (!folder_) folder_ = std::make_unique<DriveFolder>(parameters_.file);
      DriveFile& file = folder_->at(now);
      next_try_ = -1;
      tell_passed_over(now, channel);
      work(file);
      watch_.succeeded(now);
      return true;
    } catch (const MapFileError& error) {
      return fail(error, now, channel);
    } catch (const std::filesystem::filesystem_error& error) {
      return fail(MapFileError(Fault::kUnreadable, error.what()), now, channel);
    }
  }

  /// Requests the data that the next file lacks.
  void tell_passed_over(model::Utime now, const std::string& channel) {
    for (const PassedOver& one : folder_->take_passed_over()) {
      node_->report(reason_of(one.fault), one.line, channel);
      watch_.passed_over(one.fault, now);
      stage_.begin_file();
    }
  }

  /// Whether the work counts as done: a fault of one message is no fault of the file.
  bool fail(const MapFileError& error, model::Utime now, const std::string& channel) {
    node_->report(reason_of(error.fault()), error.what(), channel);
    if (error.fault() == Fault::kRefused) return true;
    watch_.failed(error.fault());
    const bool is_damaged = error.fault() == Fault::kDamaged || error.fault() == Fault::kForeign;
    if (is_damaged && folder_->current() != nullptr) {
      folder_->give_up(error);
    } else {
      folder_->close();
      next_try_ = now + kTryAgain_us;
    }
    return false;
  }

  /// Confirms a submap when it is on the device, and again each time it arrives again.
  void keep(const model::Submap& submap) {
    bool is_kept = false;
    with_file(submap.utime, channels_.submap, [&](DriveFile& file) {
      map_file::Keeping kept = file.put(submap, stage_.pose_of(submap));
      if (kept == map_file::Keeping::kOther) {
        // From another mapper, or one that was restarted.
        folder_->begin_drive();
        stage_.begin_drive();
        kept = folder_->at(submap.utime).put(submap, submap.map_T_submap);
      }
      if (kept == map_file::Keeping::kNew) stage_.stored(submap);
      is_kept = true;
    });
    if (is_kept) stored_.publish({submap.utime, 0, submap.map_id, submap.id, submap.content_hash});
  }

  void answer(const model::SubmapQuery& query) {
    for (const model::SubmapId id : query.ids) {
      std::optional<model::Submap> found;
      const bool could_look = with_file(query.utime, channels_.submap_query, [&](DriveFile& file) {
        found = file.get({query.map_id, id});
        if (!found) found = folder_->find_passed_over({query.map_id, id});
      });
      if (found) {
        found->utime = query.utime;
        replies_.publish(*found);
      } else if (could_look) {
        node_->report(
            wire::Reason::kInputRefused,
            fmt::format("submap {} of map {} is in no file of this drive that can be read", id,
                        query.map_id),
            channels_.submap_query);
      }
    }
  }

  void correct(const model::MapCorrection& correction) {
    stage_.take(correction);
    with_file(correction.utime, channels_.map_correction,
              [&](DriveFile& file) { file.put(correction); });
  }

  void follow(const model::MapUpdate& update) {
    if (update.status == model::MapUpdateStatus::kFirstMap) {
      with_file(update.utime, channels_.slam_update, [&](DriveFile& file) {
        if (!SubmapStore::begins_drive(update, file.highest_map())) return;
        stage_.draw_moved(kAll);
        write(stage_.due(), file);
        folder_->begin_drive();
        stage_ = SubmapStore();
      });
    }
    stage_.take(update);
  }

  std::size_t moved_per_period() const {
    return static_cast<std::size_t>(
        std::ceil(parameters_.writing.moved_landmarks_per_s * parameters_.writing.ground_period_s));
  }

  void write_ground(model::Utime now, std::size_t most_moved) {
    stage_.draw_moved(most_moved);
    const Writes due = stage_.due();
    if (due.empty()) return;
    const bool is_written =
        with_file(now, channels_.map_delta, [&](DriveFile& file) { write(due, file); });
    if (is_written) stage_.written();
  }

  void write(const Writes& writes, DriveFile& file) {
    for (const std::uint32_t map_id : writes.dropped_maps) file.drop(map_id);
    std::size_t left_out = 0;
    for (const map_file::GroundChange& one : writes.ground) left_out += file.put(one);
    for (const model::LoopClosure& one : writes.closures) {
      if (one.is_revoked) {
        file.take_back(one.map_id, one.id);
      } else {
        file.put(one);
      }
    }
    for (const auto& [map_id, existence] : writes.existence) file.put(map_id, existence);
    if (left_out > 0)
      node_->report(wire::Reason::kInputRefused,
                    fmt::format("{} landmarks or keyframes cannot be stored", left_out),
                    channels_.map_delta);
  }

  void tick(model::Utime now) {
    if (folder_ && folder_->current() != nullptr) {
      with_file(now, channels_.map_correction, [&](DriveFile& file) {
        file.draw(static_cast<std::size_t>(parameters_.writing.submaps_per_s));
      });
    }
    if (!stage_.wants_whole() || (asked_ >= 0 && now - asked_ < kAskAgain_us && now >= asked_))
      return;
    asked_ = now;
    map_request_t request{};
    request.utime = now;
    request.everything = 1;
    requests_.publish(request);
  }

  StoreChannels channels_;
  StoreParameters parameters_;
  bus::Node* node_ = nullptr;
  SubmapStore stage_;
  StorageWatch watch_;
  std::filesystem::path state_directory_;
  std::unique_ptr<DriveFolder> folder_;
  model::Utime next_try_ =
      -1;                    ///< Time of the next attempt after a fault of the file; -1: no fault.
  model::Utime asked_ = -1;  ///< Time of the last request for the whole map.
  bus::Publisher<model::SubmapStored> stored_;
  bus::Publisher<model::Submap> replies_;
  bus::Publisher<map_request_t> requests_;
};

}  // namespace

bus::Service submap_store_service(const StoreChannels& channels) {
  return {"submap_store", channels.all,
          [channels] { return std::make_unique<StoreAdapter>(channels); }};
}

}  // namespace understory::submap_store
