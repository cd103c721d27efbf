/* libcamera as C (camera_libcamera_shim.h). Its manager is one for the process and stays: it sees cameras come and go. */
#include "daemon/camera/camera_libcamera_shim.h"

#include <atomic>
#include <cerrno>
#include <libcamera/libcamera.h>
#include <memory>
#include <mutex>
#include <string>
#include <utility>
#include <vector>

using namespace libcamera;

struct shim_camera {
    std::shared_ptr<Camera> camera;
    std::unique_ptr<CameraConfiguration> configuration;
    std::unique_ptr<FrameBufferAllocator> allocator;
    std::vector<std::unique_ptr<Request>> requests;
    shim_done_fn done = nullptr;
    shim_gone_fn gone = nullptr;
    void *context = nullptr;
    std::atomic<bool> is_gone = false;

    void onDone(Request *request);
    void onGone();
};

namespace
{
std::mutex lock; /* of both */
std::unique_ptr<CameraManager> manager;
/* Of cameras that were unplugged while they ran: libcamera still points at their requests until it has closed the
 * device. Released at the next listing. */
std::vector<std::unique_ptr<shim_camera>> remains;

int start_manager()
{
    if (manager)
        return 0;
    auto started = std::make_unique<CameraManager>();
    const int code = started->start();
    if (code == 0)
        manager = std::move(started);
    return code;
}

template <typename T> bool has(const Camera &camera, const Control<T> &control)
{
    return camera.controls().find(control.id()) != camera.controls().end();
}

void set_controls(const Camera &camera, ControlList &list, const shim_controls &wanted)
{
    if (has(camera, controls::AeEnable))
        list.set(controls::AeEnable, wanted.exposure_s <= 0);
    if (wanted.exposure_s > 0 && has(camera, controls::ExposureTime))
        list.set(controls::ExposureTime, static_cast<int32_t>(wanted.exposure_s * 1e6 + 0.5));
    if (wanted.gain > 0 && has(camera, controls::AnalogueGain))
        list.set(controls::AnalogueGain, static_cast<float>(wanted.gain));
    if (has(camera, controls::AwbEnable))
        list.set(controls::AwbEnable, wanted.white_balance <= 0);
    if (wanted.white_balance > 0 && has(camera, controls::ColourTemperature))
        list.set(controls::ColourTemperature, static_cast<int32_t>(wanted.white_balance));
    if (wanted.frame_s > 0 && has(camera, controls::FrameDurationLimits)) {
        const int64_t us = static_cast<int64_t>(wanted.frame_s * 1e6 + 0.5);
        list.set(controls::FrameDurationLimits, {us, us});
    }
}

std::unique_ptr<CameraConfiguration> generate(Camera &camera, bool raw)
{
    return camera.generateConfiguration({raw ? StreamRole::Raw : StreamRole::VideoRecording});
}
} // namespace

void shim_camera::onDone(Request *request)
{
    const auto &[stream, buffer] = *request->buffers().begin();
    const FrameMetadata &frame = buffer->metadata();
    const ControlList &said = request->metadata();
    shim_result result = {};

    (void)stream;
    result.status = request->status() == Request::RequestCancelled || frame.status == FrameMetadata::FrameCancelled
                        ? SHIM_CANCELLED
                    : frame.status == FrameMetadata::FrameError ? SHIM_DAMAGED
                                                                : SHIM_GOOD;
    result.buffer = static_cast<int>(request->cookie());
    result.sequence = frame.sequence;
    result.buffer_ns = static_cast<int64_t>(frame.timestamp);
    for (size_t i = 0; i < frame.planes().size() && i < SHIM_PLANES; i++)
        result.used[i] = frame.planes()[i].bytesused;
    result.sensor_ns = said.get(controls::SensorTimestamp).value_or(0);
    result.exposure_s = said.get(controls::ExposureTime).value_or(0) * 1e-6;
    result.gain = said.get(controls::AnalogueGain).value_or(0) * said.get(controls::DigitalGain).value_or(1);
    if (const auto black = said.get(controls::SensorBlackLevels))
        result.black = (*black)[0];
    if (const auto gains = said.get(controls::ColourGains)) {
        result.white[0] = static_cast<double>((*gains)[0]);
        result.white[1] = static_cast<double>((*gains)[1]);
    }
    result.has_temperature = said.get(controls::SensorTemperature).has_value();
    result.temperature = said.get(controls::SensorTemperature).value_or(0);
    done(context, &result);
}

void shim_camera::onGone()
{
    is_gone = true;
    gone(context);
}

const char *shim_version(void)
{
    return CameraManager::version().c_str();
}

int shim_list(void (*each)(void *, const shim_identity *), void *context)
{
    const std::lock_guard<std::mutex> guard(lock);
    const int code = start_manager();

    remains.clear();
    if (code != 0)
        return code;
    for (const auto &camera : manager->cameras()) {
        const auto model = camera->properties().get(properties::Model);
        const auto devices = camera->properties().get(properties::SystemDevices);
        shim_identity identity = {};

        identity.id = camera->id().c_str();
        identity.model = model ? model->c_str() : "";
        identity.devices = devices ? devices->data() : nullptr;
        identity.device_count = devices ? static_cast<int>(devices->size()) : 0;
        each(context, &identity);
    }
    return 0;
}

int shim_open(const char *id, shim_done_fn done, shim_gone_fn gone, void *context, shim_camera **opened)
{
    const std::lock_guard<std::mutex> guard(lock);
    const int code = start_manager();
    auto shim = std::make_unique<shim_camera>();

    if (code != 0)
        return code;
    shim->camera = manager->get(id);
    if (!shim->camera)
        return -ENODEV;
    const int acquired = shim->camera->acquire();
    if (acquired != 0)
        return acquired;
    shim->done = done;
    shim->gone = gone;
    shim->context = context;
    shim->camera->requestCompleted.connect(shim.get(), &shim_camera::onDone);
    shim->camera->disconnected.connect(shim.get(), &shim_camera::onGone);
    *opened = shim.release();
    return 0;
}

void shim_close(shim_camera *camera)
{
    const std::lock_guard<std::mutex> guard(lock);
    std::unique_ptr<shim_camera> shim(camera);

    shim->camera->stop();
    shim->camera->requestCompleted.disconnect(camera);
    shim->camera->disconnected.disconnect(camera);
    if (shim->is_gone) {
        shim->camera->release();
        remains.push_back(std::move(shim));
        return;
    }
    shim->requests.clear();
    shim->allocator.reset();
    shim->camera->release();
}

unsigned shim_can(const shim_camera *shim)
{
    const Camera &camera = *shim->camera;

    return (has(camera, controls::ExposureTime) ? unsigned{SHIM_CAN_EXPOSE} : 0u) |
           (has(camera, controls::AnalogueGain) ? unsigned{SHIM_CAN_GAIN} : 0u) |
           (has(camera, controls::ColourTemperature) ? unsigned{SHIM_CAN_WHITE_BALANCE} : 0u) |
           (has(camera, controls::FrameDurationLimits) ? unsigned{SHIM_CAN_FRAME_TIME} : 0u);
}

int shim_formats(shim_camera *shim, bool raw, void (*each)(void *, const shim_format *), void *context)
{
    const auto configuration = generate(*shim->camera, raw);

    if (!configuration || configuration->empty())
        return 0;
    const StreamFormats &formats = configuration->at(0).formats();
    for (const PixelFormat &pixel : formats.pixelformats()) {
        shim_format format = {};

        format.raw = raw;
        format.fourcc = pixel.fourcc();
        format.modifier = pixel.modifier();
        for (const Size &size : formats.sizes(pixel))
            if (static_cast<int64_t>(size.width) * size.height > static_cast<int64_t>(format.width) * format.height) {
                format.width = static_cast<int>(size.width);
                format.height = static_cast<int>(size.height);
            }
        each(context, &format);
    }
    return 0;
}

int shim_configure(shim_camera *shim, shim_format *format)
{
    auto configuration = generate(*shim->camera, format->raw);

    if (!configuration || configuration->empty())
        return -EINVAL;
    StreamConfiguration &stream = configuration->at(0);
    stream.pixelFormat = PixelFormat(format->fourcc, format->modifier);
    stream.size = Size(static_cast<unsigned>(format->width), static_cast<unsigned>(format->height));
    if (format->buffers > 0)
        stream.bufferCount = static_cast<unsigned>(format->buffers);
    if (configuration->validate() == CameraConfiguration::Invalid)
        return -EINVAL;
    const int code = shim->camera->configure(configuration.get());
    if (code != 0)
        return code;
    format->fourcc = stream.pixelFormat.fourcc();
    format->modifier = stream.pixelFormat.modifier();
    format->width = static_cast<int>(stream.size.width);
    format->height = static_cast<int>(stream.size.height);
    format->stride = static_cast<int>(stream.stride);
    format->buffers = static_cast<int>(stream.bufferCount);
    format->bt709 = stream.colorSpace && stream.colorSpace->ycbcrEncoding == ColorSpace::YcbcrEncoding::Rec709;
    format->full_range = stream.colorSpace && stream.colorSpace->range == ColorSpace::Range::Full;
    shim->configuration = std::move(configuration);
    return 0;
}

int shim_allocate(shim_camera *shim)
{
    Stream *stream = shim->configuration->at(0).stream();

    shim->allocator = std::make_unique<FrameBufferAllocator>(shim->camera);
    const int count = shim->allocator->allocate(stream);
    if (count < 0)
        return count;
    const auto &buffers = shim->allocator->buffers(stream);
    for (size_t i = 0; i < buffers.size(); i++) {
        std::unique_ptr<Request> request = shim->camera->createRequest(i);

        if (!request)
            return -ENOMEM;
        const int code = request->addBuffer(stream, buffers[i].get());
        if (code != 0)
            return code;
        shim->requests.push_back(std::move(request));
    }
    return static_cast<int>(buffers.size());
}

int shim_buffer(shim_camera *shim, int buffer, shim_plane *planes)
{
    const auto &all = shim->allocator->buffers(shim->configuration->at(0).stream());
    const auto &found = all[static_cast<size_t>(buffer)]->planes();

    for (size_t i = 0; i < found.size() && i < SHIM_PLANES; i++)
        planes[i] = {found[i].fd.get(), found[i].offset, found[i].length};
    return static_cast<int>(found.size() < SHIM_PLANES ? found.size() : SHIM_PLANES);
}

int shim_start(shim_camera *shim, const shim_controls *wanted)
{
    ControlList list(shim->camera->controls());

    set_controls(*shim->camera, list, *wanted);
    return shim->camera->start(&list);
}

int shim_queue(shim_camera *shim, int buffer, const shim_controls *wanted)
{
    Request *request = shim->requests[static_cast<size_t>(buffer)].get();

    if (request->status() != Request::RequestPending)
        request->reuse(Request::ReuseBuffers);
    set_controls(*shim->camera, request->controls(), *wanted);
    return shim->camera->queueRequest(request);
}

int shim_stop(shim_camera *shim)
{
    const int code = shim->camera->stop();

    if (shim->is_gone)
        return code;
    shim->requests.clear();
    shim->allocator.reset();
    return code;
}
