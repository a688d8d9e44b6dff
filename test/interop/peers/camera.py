"""robotraconteur-camera-driver as it is published, with a film for a camera. It says "ready" when it serves "camera".

    camera.py PORT
"""
import sys
import tempfile

import drekar_launch_process
import quiet_node
import robotraconteur_camera_driver

INFO = """
device_info:
  device: {name: film, uuid: 4d3b7c3e-5d5b-4e7b-9a54-3f1b0c7a1f10}
  manufacturer: {name: rrgate, uuid: 5d3b7c3e-5d5b-4e7b-9a54-3f1b0c7a1f00}
  model: {name: one colour, uuid: 6d3b7c3e-5d5b-4e7b-9a54-3f1b0c7a1f10}
  user_description: A film
  serial_number: 987
  device_classes:
  - class_identifier: {name: camera, uuid: 5f8cfa63-8a4b-4ea8-9c2f-6d7ab8b0a3bb}
  implemented_types: [com.robotraconteur.imaging.Camera]
calibration:
  image_size: {width: 64, height: 48}
  K: [[70, 0, 32], [0, 70, 24], [0, 0, 1]]
  distortion_info: {k1: 0.25, k2: 0, p1: 0, p2: 0, k3: 0}
"""


def main(port):
    wait = drekar_launch_process.wait_exit

    def say_and_wait():
        print("ready", flush=True)
        wait()

    drekar_launch_process.wait_exit = say_and_wait
    with tempfile.NamedTemporaryFile("w", suffix=".yml") as info:
        info.write(INFO)
        info.flush()
        sys.argv[1:] = ["--camera-info-file=" + info.name, "--width=64", "--height=48", "--fps=30", "--brightness=200",
                        "--robotraconteur-tcp-port=" + port, *quiet_node.arguments(server=True)]
        robotraconteur_camera_driver.main()


main(sys.argv[1])
