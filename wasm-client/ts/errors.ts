// What rejects: one class for every failure, of this side and of the service. Layer: wasm-client/ts.

/** The error codes of Robot Raconteur, by the names that the protocol gives them. */
export const ErrorCode = {
  ConnectionError: 1,
  ProtocolError: 2,
  ServiceNotFound: 3,
  ObjectNotFound: 4,
  InvalidEndpoint: 5,
  EndpointCommunicationFatalError: 6,
  NodeNotFound: 7,
  ServiceError: 8,
  MemberNotFound: 9,
  MemberFormatMismatch: 10,
  DataTypeMismatch: 11,
  DataTypeError: 12,
  DataSerializationError: 13,
  MessageEntryNotFound: 14,
  MessageElementNotFound: 15,
  UnknownError: 16,
  InvalidOperation: 17,
  InvalidArgument: 18,
  OperationFailed: 19,
  NullValue: 20,
  InternalError: 21,
  SystemResourcePermissionDenied: 22,
  OutOfSystemResource: 23,
  SystemResourceError: 24,
  ResourceNotFound: 25,
  IOError: 26,
  BufferLimitViolation: 27,
  ServiceDefinitionError: 28,
  OutOfRange: 29,
  KeyNotFound: 30,
  InvalidConfiguration: 31,
  InvalidState: 32,
  RemoteError: 100,
  RequestTimeout: 101,
  ReadOnlyMember: 102,
  WriteOnlyMember: 103,
  NotImplementedError: 104,
  MemberBusy: 105,
  ValueNotSet: 106,
  AbortOperation: 107,
  OperationAborted: 108,
  StopIteration: 109,
  OperationTimeout: 110,
  OperationCancelled: 111,
  AuthenticationError: 150,
  ObjectLockedError: 151,
  PermissionDenied: 152,
} as const;

/**
 * The `subName` of ConnectionError where a connection that was up broke: calls that were under way may have been
 * carried out or not.
 */
export const connectionLost = "connection_lost";

export interface ErrorFields {
  code: number;
  name: string;
  message: string;
  subName?: string;
  param?: unknown;
}

/** A failure, of this side or of the service. Aborted calls reject with the reason of their AbortSignal instead. */
export class RobotRaconteurError extends Error {
  /** The protocol's number, as in {@link ErrorCode}; 100 for exceptions that a service definition declares. */
  readonly code: number;
  /** What a service adds to the name; usually "". "connectionLost": this call was under way when the session broke. */
  readonly subName: string;
  /** What a service adds to the message, as a varvalue; usually null. */
  readonly param: unknown;

  constructor(fields: ErrorFields) {
    super(fields.message);
    // Qualified: "RobotRaconteur.OperationFailed", "com.example.GripperJammed".
    Object.defineProperty(this, "name", { value: fields.name, configurable: true, writable: true });
    this.code = fields.code;
    this.subName = fields.subName ?? "";
    this.param = fields.param ?? null;
  }
}

type CodeName = keyof typeof ErrorCode;

export function makeError(name: CodeName, message: string): RobotRaconteurError {
  return new RobotRaconteurError({ code: ErrorCode[name], name: `RobotRaconteur.${name}`, message });
}

/** The message of whatever was thrown. */
export const textOf = (thrown: unknown): string => (thrown instanceof Error ? thrown.message : String(thrown));

/** What the other side hears of an exception: errors of the protocol as they are, others by name, as from Python. */
export function errorFields(error: unknown): ErrorFields {
  const other = { code: ErrorCode.UnknownError, subName: "" };
  const { code, subName } = error instanceof RobotRaconteurError ? error : other;
  return { code, name: error instanceof Error ? error.name : "", subName, message: textOf(error) };
}

/** Hands an exception of application code to whoever collects those, so that it ends nothing else. */
export function report(error: unknown): void {
  const { reportError } = globalThis as { reportError?: (error: unknown) => void };
  if (reportError) reportError(error);
  else console.error(error);
}

/** Calls application code; what it throws is reported and disturbs nothing else. */
export function callSafely(what: () => void): void {
  try {
    what();
  } catch (error) {
    report(error);
  }
}
