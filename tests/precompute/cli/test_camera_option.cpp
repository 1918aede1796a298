// Which camera render and bake take, and the exposure that they find for it.

#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "tests/support/command_line.h"

namespace rebounce::test_camera_option {
namespace {

using nlohmann::json;
using test::CommandLine;
using test::kDone;
using test::kLights;
using test::kScenes;
using test::Words;

class CameraOption : public CommandLine {
 protected:
  // The furnished room without its camera.
  std::string furnished_room(const std::string& patches) {
    json document = json::parse(test::read_bytes(kScenes + "furnished_room.gltf"));
    document.erase("cameras");
    for (json& node : document["nodes"]) node.erase("camera");
    const std::string scene = write("room.gltf", document.dump());
    std::string file = path("room" + patches + ".safetensors");
    EXPECT_EQ(run({"precompute", scene, "--patches", patches, "--quality", "low", "--tolerance",
                   "0.1", "--quiet", "-o", file})
                  .exit_code,
              kDone);
    return file;
  }

  json rendered(const std::string& file, const Words& options) {
    Words words = {"render", file, "--size", "32x18", "-o", path("x.png")};
    words.insert(words.end(), options.begin(), options.end());
    return summary_of(words);
  }

  json baked(const std::string& file, const Words& options) {
    Words words = {"bake", file, "--triangles", "1", "-o", path("x.glb")};
    words.insert(words.end(), options.begin(), options.end());
    return summary_of(words);
  }
};

TEST_F(CameraOption, DependsNeitherOnLightsNorOnPatchesNorOnTheCommand) {
  const std::string file = furnished_room("300"), other = furnished_room("450");
  const json camera = rendered(file, {"--key-light"})["camera"];
  EXPECT_EQ(camera["source"], "geometry");
  EXPECT_FLOAT_EQ(camera["position"][1].get<float>(), 1.6F);
  EXPECT_EQ(rendered(other, {"--key-light"})["camera"], camera);
  EXPECT_EQ(rendered(file, {"--show", "patches"})["camera"], camera);
  const std::string lamps[] = {
      R"({"type": "point", "position": [0.5, 2, 0.5], "intensity": 50})",
      R"({"type": "directional", "direction": [-1, -2, 0.5], "intensity": 5000})",
      R"({"type": "sphere", "position": [2, 1.5, 2], "radius": 0.1, "intensity": 90})"};
  for (const std::string& lamp : lamps) {
    const Words lights = {"--lights", write("lights.json", R"({"lights": [)" + lamp + "]}")};
    const json drawn = rendered(file, lights), lit = baked(file, lights);
    EXPECT_EQ(drawn["camera"], camera) << lamp;
    EXPECT_EQ(lit["camera"], camera) << lamp;
    EXPECT_EQ(lit["exposure"], drawn["exposure"]) << lamp;
  }
}

TEST_F(CameraOption, IsSaidSoThatItCanBeGivenAgain) {
  const std::string file = furnished_room("300");
  const json camera = rendered(file, {"--key-light"})["camera"];
  const std::string said =
      run({"render", file, "--key-light", "--size", "32x18", "-o", path("x.png")}).out;
  const std::size_t at = said.find("--camera ");
  ASSERT_NE(at, std::string::npos) << said;
  const std::string numbers = said.substr(at + 9, said.find('\n', at) - at - 9);
  const json again = rendered(file, {"--key-light", "--camera", numbers})["camera"];
  EXPECT_EQ(again["source"], "numbers");
  EXPECT_NEAR(again["degrees"], camera["degrees"], 0.01);
  for (const char* name : {"position", "direction"}) {
    for (int k = 0; k < 3; ++k) {
      EXPECT_NEAR(again[name][k].get<float>(), camera[name][k].get<float>(), 2e-3F) << name;
    }
  }
}

TEST_F(CameraOption, TakesThoseOfTheSceneFirstByNameOrNumber) {
  const std::string file = built("box.safetensors");
  const Words lights = {"--lights", kLights};
  const json camera = rendered(file, lights)["camera"];
  EXPECT_EQ(camera["source"], "scene");
  EXPECT_EQ(camera["name"], "measured");
  for (const char* wanted : {"measured", "0"}) {
    EXPECT_EQ(rendered(file, {"--lights", kLights, "--camera", wanted})["camera"], camera);
  }
  expect_refused({"render", file, "--lights", kLights, "--camera", "front", "-o", path("no.png")},
                 "no camera \"front\": the scene has \"measured\"");
}

TEST_F(CameraOption, ExposesForWhatIsShown) {
  const std::string file = built("box.safetensors");
  const auto exposure = [&](const char* show) {
    return rendered(file, {"--lights", kLights, "--show", show})["exposure"].get<double>();
  };
  EXPECT_GT(exposure("indirect"), exposure("radiosity") + 0.5) << "bounced light alone is darker";
}

}  // namespace
}  // namespace rebounce::test_camera_option
