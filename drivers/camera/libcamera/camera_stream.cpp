#include "drivers/camera/libcamera/camera_stream.hpp"

#include <algorithm>
#include <array>
#include <utility>

#include <libcamera/camera.h>
#include <libcamera/control_ids.h>
#include <libcamera/framebuffer.h>
#include <libcamera/framebuffer_allocator.h>
#include <libcamera/request.h>
#include <libcamera/stream.h>

#include "drivers/camera/libcamera/control_lists.hpp"
#include "drivers/camera/libcamera/drm_format.hpp"

namespace trigmesh {
namespace {

using std::chrono::nanoseconds;

libcamera::StreamRole role_of(CameraUse use) {
  return use == CameraUse::kStill ? libcamera::StreamRole::StillCapture
                                  : libcamera::StreamRole::VideoRecording;
}

CameraMode mode_of(PixelFormat format, const libcamera::Size& size) {
  return {format, static_cast<int>(size.width), static_cast<int>(size.height), nanoseconds(0)};
}

/// What the configuration offers in formats that we read; the wished size where any is taken. A
/// pipeline that tells no formats is offered each of ours, and its answer shows what it has.
std::vector<CameraMode> modes_of(const libcamera::StreamConfiguration& offered,
                                 const CameraWish& wish) {
  std::vector<CameraMode> modes;
  for (const libcamera::PixelFormat& theirs : offered.formats().pixelformats()) {
    const std::optional<PixelFormat> format = format_of_drm_code(theirs.fourcc());
    if (!format || theirs.modifier() != 0) {
      continue;
    }
    for (const libcamera::Size& size : offered.formats().sizes(theirs)) {
      modes.push_back(mode_of(*format, size));
    }
    const libcamera::SizeRange range = offered.formats().range(theirs);
    if (range.max.width > 0 && range.max.height > 0) {
      const int width = nearest_step(wish.width_px, range.min.width, range.max.width, range.hStep);
      const int height =
          nearest_step(wish.height_px, range.min.height, range.max.height, range.vStep);
      modes.push_back({*format, width, height, nanoseconds(0)});
    }
  }
  if (const auto format = format_of_drm_code(offered.pixelFormat.fourcc());
      format && modes.empty()) {
    modes.push_back({*format, wish.width_px, wish.height_px, nanoseconds(0)});
  }
  return modes;
}

FilledSlot filled_slot_of(const libcamera::FrameBuffer& buffer,
                          const libcamera::ControlList& metadata) {
  namespace controls = libcamera::controls;
  const libcamera::FrameMetadata& told = buffer.metadata();
  FilledSlot filled;
  for (const libcamera::FrameMetadata::Plane& plane : told.planes()) {
    filled.bytes_used += plane.bytesused;
  }
  filled.sequence = told.sequence;
  filled.is_damaged = told.status != libcamera::FrameMetadata::FrameSuccess;
  if (const auto time = metadata.get(controls::SensorTimestamp)) {
    filled.times.sensor = nanoseconds(*time);
  }
  if (told.timestamp != 0) {
    filled.times.buffer = nanoseconds(static_cast<std::int64_t>(told.timestamp));
  }
  if (const auto exposure = metadata.get(controls::ExposureTime)) {
    filled.exposure = std::chrono::microseconds(*exposure);
  }
  if (const auto gain = metadata.get(controls::AnalogueGain)) {
    const auto digital = metadata.get(controls::DigitalGain);
    filled.gain = static_cast<double>(*gain) * static_cast<double>(digital.value_or(1.0F));
  }
  filled.controls = read_controls(metadata);
  return filled;
}

/// Asks for the wished rate where the camera has limits to set; 0 where it has none.
nanoseconds request_rate(libcamera::ControlList& request,
                         const libcamera::ControlInfoMap& camera,
                         const CameraWish& wish) {
  const auto limits = camera.find(libcamera::controls::FrameDurationLimits.id());
  if (limits == camera.end() || limits->second.min().type() != libcamera::ControlTypeInteger64 ||
      limits->second.max().type() != libcamera::ControlTypeInteger64 ||
      limits->second.min().isArray() || limits->second.max().isArray()) {
    return nanoseconds(0);
  }
  const auto shortest = limits->second.min().get<std::int64_t>();
  const auto longest = std::max(shortest, limits->second.max().get<std::int64_t>());
  const std::int64_t wanted_us =
      std::chrono::duration_cast<std::chrono::microseconds>(wished_interval(wish)).count();
  const std::int64_t interval = std::clamp(wanted_us, shortest, longest);
  const std::array<std::int64_t, 2> both = {interval, interval};
  request.set(libcamera::controls::FrameDurationLimits,
              libcamera::Span<const std::int64_t, 2>(both));
  return std::chrono::microseconds(interval);
}

}  // namespace

DeviceResult<std::unique_ptr<CameraStream>> CameraStream::start(CameraHub& hub,
                                                                const std::string& stable_name,
                                                                const StreamWish& wish) {
  TM_ASSIGN_OR_FAULT(std::shared_ptr<libcamera::Camera> camera, hub.get(stable_name));
  std::unique_ptr<CameraStream> stream(new CameraStream(hub, std::move(camera)));
  if (const int status = stream->camera_->acquire(); status < 0) {
    return stream->failed(status, "cannot acquire camera");
  }
  stream->is_acquired_ = true;
  TM_RETURN_IF_FAULT(stream->configure(wish));
  TM_RETURN_IF_FAULT(stream->allocate());
  TM_RETURN_IF_FAULT(stream->run(wish));
  return stream;
}

CameraStream::CameraStream(CameraHub& hub, std::shared_ptr<libcamera::Camera> camera)
    : hub_(hub), camera_(std::move(camera)), name_(camera_->id()) {}

CameraStream::~CameraStream() {
  end();
}

tl::unexpected<DeviceFault> CameraStream::failed(int status, std::string_view attempt) const {
  return tl::unexpected<DeviceFault>(fault_of_errno(-status, attempt, name_));
}

DeviceResult<> CameraStream::configure(const StreamWish& wish) {
  configuration_ = camera_->generateConfiguration({role_of(wish.use)});
  if (configuration_ == nullptr || configuration_->empty()) {
    return device_fault(FaultKind::kFormatRefused,
                        "camera {} has no stream for {}; choose the other use",
                        name_,
                        wish.use == CameraUse::kStill ? "still pictures" : "video");
  }
  libcamera::StreamConfiguration& offered = configuration_->at(0);
  TM_ASSIGN_OR_FAULT(const CameraMode mode,
                     choose_mode(modes_of(offered, wish.wish), wish.wish, name_));
  offered.pixelFormat = libcamera::PixelFormat(drm_code_of(mode.format));
  offered.size = {static_cast<unsigned int>(mode.width_px),
                  static_cast<unsigned int>(mode.height_px)};
  offered.stride = 0;  // the pipeline's choice
  offered.bufferCount = static_cast<unsigned int>(wish.buffer_count);
  TM_RETURN_IF_FAULT(agree(wish.wish));
  if (const int status = camera_->configure(configuration_.get()); status < 0) {
    return failed(status, "cannot set the picture format of camera");
  }
  // What the pipeline made of it is known only now: stride and stream.
  const libcamera::StreamConfiguration& agreed = configuration_->at(0);
  stream_ = agreed.stream();
  layout_.stride_bytes = is_encoded(layout_.format) ? 0 : agreed.stride;
  if (layout_.stride_bytes < row_bytes(layout_.format, layout_.width_px)) {
    return device_fault(FaultKind::kFormatRefused,
                        "camera {} claims {} pixels of {} in rows of {} bytes",
                        name_,
                        layout_.width_px,
                        to_string(layout_.format),
                        layout_.stride_bytes);
  }
  return {};
}

DeviceResult<> CameraStream::agree(const CameraWish& wish) {
  const bool is_valid = configuration_->validate() != libcamera::CameraConfiguration::Invalid;
  const libcamera::StreamConfiguration& agreed = configuration_->at(0);
  const std::optional<PixelFormat> format = format_of_drm_code(agreed.pixelFormat.fourcc());
  if (!is_valid || !format || (wish.format && *wish.format != *format)) {
    return device_fault(FaultKind::kFormatRefused,
                        "camera {} was asked for {} x {} pixels and {} {}; choose another format",
                        name_,
                        wish.width_px,
                        wish.height_px,
                        is_valid ? "insists on" : "refuses",
                        agreed.toString());
  }
  layout_ = {.format = *format,
             .width_px = static_cast<int>(agreed.size.width),
             .height_px = static_cast<int>(agreed.size.height),
             .stride_bytes = 0};
  return {};
}

DeviceResult<> CameraStream::allocate() {
  allocator_ = std::make_unique<libcamera::FrameBufferAllocator>(camera_);
  if (const int status = allocator_->allocate(stream_); status < 0) {
    return failed(status, "cannot get frame buffers from camera");
  }
  const std::size_t chroma_offset =
      layout_.stride_bytes * static_cast<std::size_t>(layout_.height_px);
  std::vector<MappedPlanes> memory;
  for (const std::unique_ptr<libcamera::FrameBuffer>& buffer : allocator_->buffers(stream_)) {
    std::vector<PlanePlace> planes;
    for (const libcamera::FrameBuffer::Plane& plane : buffer->planes()) {
      planes.push_back({plane.fd.get(), plane.offset, plane.length});
    }
    TM_ASSIGN_OR_FAULT(MappedPlanes mapped, MappedPlanes::map(planes, chroma_offset, name_));
    memory.push_back(std::move(mapped));
    std::unique_ptr<libcamera::Request> request = camera_->createRequest(requests_.size());
    if (request == nullptr) {
      return device_fault(FaultKind::kIo, "camera {} makes no request for a frame", name_);
    }
    if (const int status = request->addBuffer(stream_, buffer.get()); status < 0) {
      return failed(status, "cannot add a frame buffer to a request of camera");
    }
    requests_.push_back(std::move(request));
  }
  rounds_.resize(requests_.size());
  exchange_ = std::make_shared<FrameExchange>(std::move(memory));
  if (!exchange_->valid()) {
    return device_fault(
        FaultKind::kIo, "cannot use camera {}: the system has no file descriptors left", name_);
  }
  return {};
}

DeviceResult<> CameraStream::run(const StreamWish& wish) {
  hub_.watch(*camera_, exchange_);
  presence_ = hub_.presence_of(camera_);
  camera_->requestCompleted.connect(this, &CameraStream::on_completed);
  libcamera::ControlList first(camera_->controls());
  frame_interval_ = request_rate(first, camera_->controls(), wish.wish);
  for (const SentControl& sent : wish.controls) {
    write_control(first, sent.control, sent.blue_gain);
  }
  if (const int status = camera_->start(&first); status < 0) {
    return failed(status, "cannot start the stream of camera");
  }
  if (!exchange_->begin([this](std::size_t slot) { return queue(slot); })) {
    return device_fault(FaultKind::kIo,
                        "cannot stream from camera {}: it takes {} of {} frame buffers",
                        name_,
                        exchange_->queued_count(),
                        exchange_->count());
  }
  return {};
}

bool CameraStream::queue(std::size_t slot) {
  libcamera::Request& request = *requests_[slot];
  request.reuse(libcamera::Request::ReuseBuffers);
  {
    const std::lock_guard lock(mutex_);
    for (const SentControl& sent : pending_) {
      write_control(request.controls(), sent.control, sent.blue_gain);
    }
    pending_.clear();
    rounds_[slot] = last_round_;
  }
  return camera_->queueRequest(&request) == 0;
}

void CameraStream::on_completed(libcamera::Request* request) {
  const auto slot = static_cast<std::size_t>(request->cookie());
  const libcamera::FrameBuffer* const buffer = request->findBuffer(stream_);
  if (request->status() != libcamera::Request::RequestComplete || buffer == nullptr) {
    exchange_->on_cancelled(slot);
    return;
  }
  FilledSlot filled = filled_slot_of(*buffer, request->metadata());
  filled.slot = slot;
  {
    const std::lock_guard lock(mutex_);
    filled.control_round = rounds_[slot];
  }
  exchange_->on_filled(filled);
}

std::optional<ControlRange> CameraStream::range(ControlId id) const {
  return range_of(camera_->controls(), id);
}

std::uint64_t CameraStream::send(const SentControl& control) {
  const std::lock_guard lock(mutex_);
  pending_.push_back(control);
  return ++last_round_;
}

void CameraStream::notice_loss() {
  if (!exchange_->is_gone() && presence_.is_lost()) {
    is_abandoned_ = true;
    exchange_->on_gone();
  }
}

void CameraStream::end() {
  if (!is_acquired_) {
    return;
  }
  is_acquired_ = false;
  if (exchange_ != nullptr) {
    notice_loss();
    exchange_->end();
  }
  if (is_abandoned_) {
    // Nothing completes any more, and stop() would end the process: libcamera waits for requests
    // that its driver does not give back.
    camera_->requestCompleted.disconnect(this);
    return;
  }
  // Returns when all requests are completed or cancelled and nothing more comes; a camera that went
  // does nothing here, and its signal was cut by the hub.
  (void)camera_->stop();
  camera_->requestCompleted.disconnect(this);
  (void)camera_->release();
}

}  // namespace trigmesh
