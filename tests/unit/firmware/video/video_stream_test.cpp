#include "firmware/video/video_stream.hpp"

#include <string>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace trigmesh {
namespace {

using ::testing::HasSubstr;

/// An answer with one stream of these members.
std::string answer(const std::string& stream, const std::string& format = "{}") {
  return R"({"programs": [], "streams": [{)" + stream + R"(}], "format": )" + format + "}";
}

const std::string kPicture = R"("index": 0, "codec_name": "h264", "codec_type": "video")";

TEST(VideoStream, ReadsTheAnswerOfAPhoneVideo) {
  const auto stream = parse_video_stream(R"({"programs": [], "streams": [
    {"index": 0, "codec_name": "aac", "codec_type": "audio", "avg_frame_rate": "0/0"},
    {"index": 1, "codec_name": "hevc", "codec_type": "video", "width": 1920, "height": 1080,
     "avg_frame_rate": "30000/1001", "duration": "10.010000", "nb_frames": "300",
     "disposition": {"attached_pic": 0}, "side_data_list": [{"rotation": -90}]}],
    "format": {"duration": "10.05"}})",
                                         "clip.mp4");
  ASSERT_TRUE(stream.has_value()) << stream.error().message;
  EXPECT_EQ(stream->index, 1);
  EXPECT_EQ(stream->codec, "hevc");
  EXPECT_EQ(stream->width_px, 1080) << "turned by a quarter";
  EXPECT_EQ(stream->height_px, 1920);
  EXPECT_EQ(stream->frame_count, 300U);
  EXPECT_DOUBLE_EQ(stream->duration_s.value(), 10.01);
}

TEST(VideoStream, EstimatesTheCountFromDurationAndRate) {
  const auto stream = parse_video_stream(
      answer(kPicture + R"(, "width": 640, "height": 480, "avg_frame_rate": "30/1")",
             R"({"duration": "10.0"})"),
      "v.mkv");
  ASSERT_TRUE(stream.has_value());
  EXPECT_EQ(stream->frame_count, 300U);
}

TEST(VideoStream, KnowsNoCountWithoutRateOrDuration) {
  for (const char* more : {R"("avg_frame_rate": "0/0", "duration": "10")",
                           R"("avg_frame_rate": "30/1")",
                           R"("avg_frame_rate": "30/1", "duration": "-1")",
                           R"("avg_frame_rate": "30/1", "duration": "1e300")",
                           R"("avg_frame_rate": "1e300/1", "duration": "10")",
                           R"("nb_frames": "many")"}) {
    const auto stream =
        parse_video_stream(answer(kPicture + R"(, "width": 64, "height": 48, )" + more), "v.ts");
    ASSERT_TRUE(stream.has_value()) << more;
    EXPECT_FALSE(stream->frame_count.has_value()) << more;
  }
}

TEST(VideoStream, LeavesPicturesThatAreNotTurnedByAQuarter) {
  for (const char* degrees : {"0", "180", "-180", "360"}) {
    const auto stream = parse_video_stream(
        answer(kPicture + R"(, "width": 64, "height": 48, "side_data_list": [{"rotation": )" +
               degrees + "}]"),
        "v.mp4");
    ASSERT_TRUE(stream.has_value());
    EXPECT_EQ(stream->width_px, 64) << degrees;
  }
}

TEST(VideoStream, SaysThatSoundAndCoverPicturesAreNoVideo) {
  for (const std::string& text :
       {answer(R"("index": 0, "codec_type": "audio")"),
        answer(kPicture + R"(, "width": 64, "height": 48, "disposition": {"attached_pic": 1})")}) {
    const auto stream = parse_video_stream(text, "song.mp3");
    ASSERT_FALSE(stream.has_value());
    EXPECT_EQ(stream.error().code, ErrorCode::kUnsupported);
    EXPECT_THAT(stream.error().message, HasSubstr("song.mp3 has no moving pictures"));
  }
}

TEST(VideoStream, RefusesDamagedSizes) {
  for (const char* size : {R"("width": 0, "height": 480)",
                           R"("width": 640)",
                           R"("width": "640", "height": 480)",
                           R"("width": 640, "height": -480)",
                           R"("width": 640.5, "height": 480)"}) {
    const auto stream = parse_video_stream(answer(kPicture + ", " + size), "v.mp4");
    ASSERT_FALSE(stream.has_value()) << size;
    EXPECT_EQ(stream.error().code, ErrorCode::kCorruptData) << size;
  }
}

TEST(VideoStream, RefusesPicturesBeyondTheDecoder) {
  const auto fits =
      parse_video_stream(answer(kPicture + R"(, "width": 20000, "height": 10000)"), "v.mp4");
  EXPECT_TRUE(fits.has_value());
  const auto stream =
      parse_video_stream(answer(kPicture + R"(, "width": 20001, "height": 10000)"), "v.mp4");
  ASSERT_FALSE(stream.has_value());
  EXPECT_EQ(stream.error().code, ErrorCode::kLimitExceeded);
}

TEST(VideoStream, RefusesWhatIsNotAnAnswer) {
  for (const char* text : {"", "{", "[]", "3", "{}", R"({"streams": {}})"}) {
    const auto stream = parse_video_stream(text, "v.mp4");
    ASSERT_FALSE(stream.has_value()) << text;
    EXPECT_EQ(stream.error().code, ErrorCode::kCorruptData) << text;
  }
}

}  // namespace
}  // namespace trigmesh
