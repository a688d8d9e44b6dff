// The definitions of a service with an arm: structs, enums, flags, lists and maps. Test support.
import { Definitions } from "../../web/src/values/definitions";

export const armService = `service com.example.arm
stdver 0.10
import com.robotraconteur.uuid
using com.robotraconteur.uuid.UUID
using com.robotraconteur.uuid.UUID as Name
enum Mode
    off = -1,
    halt, jog = 0x10,
    run
end
enum ArmStateFlags
    unknown = 0, error = 0x1, ready = 0x2, high = 0x40000
end
struct Pose
    ## Where it is [mm]
    field double x
    field double[3] q
    field Mode mode
end
struct Arm
    field Pose pose
    field Pose{list} path
    field double{string} limits
    field UUID id
    field Name other
    field uint64 arm_state_flags
    field uint8[] __proto__
    field Arm{list} inner
end
object Robot
    property double then
end
`;
export const uuidService = `service com.robotraconteur.uuid
namedarray UUID
    field uint8[16] uuid_bytes
end`;
export const definitions = new Definitions([armService, uuidService]);
export const scope = "com.example.arm";
